"""Opens the built pages in Chromium, from their folder: no request leaves it, the console stays empty, the search finds names, also where a server has the pages, and axe finds no serious defect.

Usage: python check_browser.py SITE [--check] [--screenshots FOLDER], with the packages of docs/site/requirements.txt."""
import argparse
import contextlib
import functools
import http.server
import sys
import threading
from pathlib import Path

from axe_playwright_python.sync_playwright import Axe
from playwright.sync_api import TimeoutError, sync_playwright

CHROMIUM = "/usr/bin/chromium"
# A page of each kind.
KINDS = {"start": "index.html", "concepts": "concepts.html", "guide": "queries.html", "examples": "examples/index.html", "cpp": "reference/cpp/questions/contact_query.html",
         "cpp_names": "reference/cpp/index.html", "c": "reference/c/tandem.html", "python": "reference/python/scenes.html", "rows": "reference/python/rows.html",
         "command_line": "command_line.html", "charts": "charts.html", "comparison": "comparison.html", "tables": "results/gpu_tables.html", "decision": "decisions/trees.html",
         "proof": "oriented_box_test.html", "source": "source/docs/examples/soft_ball.py.html"}
# {what is typed: the page and place that the list of results must hold}
SEARCHES = {"ContactQuery": "contact_query.html#ContactQuery", "tandem_scene_find_contacts": "tandem.html#tandem_scene_find_contacts", "bodies_at": "scenes.html#tandem.Scene.bodies_at",
            "set_assets": "scene.html#Scene.set_assets", "leave_out_rings": "contact_query.html#ContactOptions", "CollisionManager": "trimesh.html#tandem.trimesh.CollisionManager",
            "--levels": "command_line.html#bvhbuild-levels", "--leave-out-rings": "command_line.html#bvhbench-query-leave-out-rings",
            "--memory": "command_line.html#bvhbench-economy-memory", "expansion-limit": "command_line.html#bvhbuild-expansion-limit", "imaginary node": "concepts.html#imaginary-node", "kNoTopology": "status.html#Status"}
FIRST = 5  # pages of the list in which it must be
WIDTHS, SCHEMES = (390, 820, 1440), ("light", "dark")
# Shows all pictures, and returns those that cannot be shown.
SHOW_PICTURES = """Promise.all([...document.images].map(image => {
    image.loading = "eager";
    return image.decode().then(() => null, () => image.src);
})).then(all => all.filter(Boolean))"""
BAD = ("serious", "critical")


class Quiet(http.server.SimpleHTTPRequestHandler):
    def log_message(self, *_):
        pass


@contextlib.contextmanager
def serving(site):
    """A server of the pages; gives its address."""
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), functools.partial(Quiet, directory=site)) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()


class Visits:
    """Opens pages and collects what goes wrong in them. site: the address of their folder."""

    def __init__(self, browser, site):
        self.browser, self.site, self.defects = browser, site, []
        self.axe = Axe()

    def open(self, page, width, scheme):
        context = self.browser.new_context(viewport={"width": width, "height": 900}, color_scheme=scheme, reduced_motion="reduce")
        context.set_default_timeout(120_000)
        tab = context.new_page()
        where = f"{page}, {width} pixels, {scheme}"
        tab.on("console", lambda message: self.defects.append(f"{where}: console: {message.text}") if message.type in ("error", "warning") else None)
        tab.on("pageerror", lambda error: self.defects.append(f"{where}: {error}"))
        tab.on("request", lambda request: self.defects.append(f"{where}: asks for {request.url}") if not request.url.startswith((self.site, "data:", "blob:", "about:")) else None)
        tab.on("requestfailed", lambda request: self.defects.append(f"{where}: does not get {request.url}"))
        tab.goto(f"{self.site}/{page}")
        return tab

    def check_page(self, page, width, scheme):
        tab = self.open(page, width, scheme)
        wide = tab.evaluate("document.documentElement.scrollWidth - innerWidth")
        if wide > 0:
            self.defects.append(f"{page}: is {wide} pixels wider than a screen of {width}")
        self.defects += [f"{page}: a picture is not shown: {source}" for source in tab.evaluate(SHOW_PICTURES)]
        for violation in self.axe.run(tab, options={"preload": False}).response["violations"]:
            if violation["impact"] in BAD:
                places = [(node["target"], node["any"][0]["message"] if node["any"] else "") for node in violation["nodes"][:3]]
                self.defects.append(f"{page}, {width} pixels, {scheme}: axe: {violation['id']} ({len(violation['nodes'])}): {places}")
        tab.context.close()

    def check_search(self):
        tab = self.open("index.html", 1440, "light")
        for words, wanted in SEARCHES.items():
            tab.keyboard.press("Escape")
            tab.keyboard.press("/")
            tab.fill("[data-md-component=search-query]", "")
            tab.keyboard.press("Backspace")
            tab.wait_for_selector(".md-search-result__item", state="detached")  # those of the words before
            tab.fill("[data-md-component=search-query]", words[:-1])
            tab.keyboard.type(words[-1])  # the search begins when a key is released
            page, _, anchor = wanted.partition("#")
            link = f".md-search-result__item:nth-child(-n+{FIRST}) .md-search-result__link[href*='{page}'][href$='#{anchor}']"
            try:
                tab.wait_for_selector(link, state="attached", timeout=30000)
            except TimeoutError:
                found = tab.eval_on_selector_all(".md-search-result__link", "all => all.slice(0, 9).map(link => link.getAttribute('href').replace(/.*build.site./, ''))")
                self.defects.append(f"the search for {words} does not find {wanted}, but {found}")
        tab.context.close()

    def check_toggle(self):
        tab = self.open("index.html", 1440, "light")
        tab.click("label[title='Switch to dark colours']")
        if tab.evaluate("document.body.dataset.mdColorScheme") != "slate":
            self.defects.append("the toggle does not switch to dark colours")
        tab.context.close()

    def picture(self, name, page, width, scheme, folder):
        tab = self.open(page, width, scheme)
        tab.evaluate(SHOW_PICTURES)
        tab.screenshot(path=folder / f"{name}_{width}_{scheme}.png", clip={"x": 0, "y": 0, "width": width, "height": 1800}, full_page=True)
        tab.context.close()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("site", type=Path)
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--screenshots", type=Path)
    options = parser.parse_args()
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=CHROMIUM, args=["--no-sandbox"])
        visits = Visits(browser, options.site.resolve().as_uri())
        if options.check:
            visits.check_search()
            with serving(options.site) as address:
                served = Visits(browser, address)
                served.check_search()
                visits.defects += served.defects
            visits.check_toggle()
            for page in KINDS.values():
                for width, scheme in ((390, "light"), (1440, "dark")):
                    visits.check_page(page, width, scheme)
                print(f"looked at {page}", flush=True)
        if options.screenshots:
            options.screenshots.mkdir(parents=True, exist_ok=True)
            for name, page in KINDS.items():
                for width in WIDTHS:
                    for scheme in SCHEMES:
                        visits.picture(name, page, width, scheme, options.screenshots)
        browser.close()
    print("\n".join(dict.fromkeys(visits.defects)) or "browser: no defect", flush=True)
    sys.exit(bool(visits.defects))


if __name__ == "__main__":
    main()
