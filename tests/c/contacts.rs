mod tandem;

use std::ffi::{CStr, CString};
use std::ptr::{null, null_mut};
use tandem::*;

fn check(status: tandem_status) {
    if status != TANDEM_OK {
        panic!("{}", unsafe { CStr::from_ptr(tandem_status_explain(status)) }.to_string_lossy());
    }
}

fn main() {
    let path = CString::new(std::env::args().nth(1).expect("a .bvh file")).unwrap();
    let at = |x| tandem_instance {
        asset: 0,
        reserved: 0,
        pose: tandem_pose { rotation: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], translation: [x, 0.0, 0.0] },
    };
    let bodies = [at(0.0), at(0.5)];
    unsafe {
        let (mut asset, mut scene, mut count) = (null_mut(), null_mut(), 0);
        check(tandem_asset_open(path.as_ptr(), null(), null(), &mut asset, null_mut()));
        check(tandem_scene_create(null(), &mut scene));
        check(tandem_scene_set_assets(scene, &asset, 1));
        tandem_asset_release(asset); // the scene has a reference of its own
        check(tandem_scene_place(scene, bodies.as_ptr(), bodies.len(), null()));
        check(tandem_scene_find_contacts(scene, null()));
        let first = tandem_scene_contacts(scene, &mut count);
        print!("{count} pairs of triangles meet");
        if count > 0 {
            print!(", such as faces {} and {}", (*first).face_a, (*first).face_b);
        }
        println!();
        tandem_scene_destroy(scene);
    }
}
