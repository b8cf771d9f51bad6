# Engines, mass properties and contact points.
set(contact_scene contact_scene.cpp ../kernels/query_scenes.cpp ../build/sample_asset.cpp)

tandem_test(contact_generation_test SOURCES contact_generation_test.cpp ${contact_scene}
  LIBRARIES tandem_contacts tandem_build TBB::tbb)
tandem_test(mass_properties_test SOURCES mass_properties_test.cpp ${contact_scene} LIBRARIES tandem_contacts tandem_build)
tandem_test(engine_test SOURCES engine_test.cpp ${contact_scene} LIBRARIES tandem_contacts tandem_build)
