"""The built book in a headless browser: what a reader would see, on a desk and on a phone.

Run by `make browser`, which builds the book first. The browser is a Chromium or Chrome that is
installed already; `CHROMIUM` names another one.
"""

import re
import threading
import time
from collections.abc import Callable, Iterator
from functools import partial
from http.server import SimpleHTTPRequestHandler, ThreadingHTTPServer
from io import StringIO
from pathlib import Path
from urllib.parse import unquote, urldefrag, urljoin

import numpy as np
import pandas as pd
import pytest
from playwright.sync_api import Locator, Page, Route

ROOT = Path(__file__).parent.parent
SITE = ROOT / "_build" / "html"
CLAIMS = ROOT / "book" / "data" / "claims.csv"
PAGES = sorted(
    path.relative_to(SITE).as_posix()
    for path in SITE.rglob("*.html")
    if not path.relative_to(SITE).parts[0].startswith("_")
)
VIEWS = {
    f"{name} {scheme}": {"viewport": {"width": width, "height": 900}, "color_scheme": scheme}
    for name, width in (("desk", 1400), ("phone", 390))
    for scheme in ("light", "dark")
}


class QuietHandler(SimpleHTTPRequestHandler):
    """Serves the site and keeps no log."""

    def log_message(self, *_arguments: object) -> None:
        """Say nothing."""


@pytest.fixture(scope="session")
def address() -> Iterator[str]:
    """Serve the site as a web server would: from a file, browsers refuse some of its fonts."""
    assert (SITE / "index.html").exists(), f"no book in {SITE}: make book"
    handler = partial(QuietHandler, directory=str(SITE))
    with ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        yield f"http://127.0.0.1:{server.server_port}"
        server.shutdown()
        thread.join()


class Visit:
    """One page in one view, with everything that went wrong on the way."""

    def __init__(self, page: Page, address: str) -> None:
        self.page, self.address = page, address
        self.problems: list[str] = []
        page.set_default_timeout(120_000)  # milliseconds: for a machine that is busy
        page.on("console", self._console)
        page.on("pageerror", lambda error: self.problems.append(f"error: {error}"))
        page.on("requestfailed", self._failed)
        page.on("response", self._response)
        page.route(lambda url: not url.startswith((address, "data:", "blob:")), self._outside)

    def _console(self, message) -> None:
        if message.type in ("error", "warning"):
            self.problems.append(f"console: {message.text}")

    def _failed(self, request) -> None:
        # Of a film no more than its beginning is loaded before it is played.
        if (request.resource_type, request.failure) != ("media", "net::ERR_ABORTED"):
            self.problems.append(f"failed: {request.url}")

    def _response(self, response) -> None:
        if response.status >= 400:
            self.problems.append(f"{response.status}: {response.url}")

    def _outside(self, route: Route) -> None:
        self.problems.append(f"another host: {route.request.url}")
        route.abort()

    def go(self, path: str) -> "Visit":
        """Open a page, and wait until it has loaded everything and set its mathematics."""
        self.problems.clear()
        self.page.goto(f"{self.address}/{path}", wait_until="networkidle")
        self.page.wait_for_function(
            "() => !window.MathJax || document.documentElement.dataset.formulas === 'set'"
        )
        return self

    def find(self, script: str) -> list[str]:
        """What a script finds in the article."""
        return self.page.evaluate(
            f"async () => {{ const article = document.querySelector('article, main'); {script} }}"
        )


@pytest.fixture(scope="module", params=VIEWS)
def view(request, browser, address) -> Iterator[Visit]:
    """A window of a certain width, light or dark."""
    with browser.new_context(**VIEWS[request.param]) as context:
        yield Visit(context.new_page(), address)


@pytest.fixture(scope="module")
def desk(browser, address) -> Iterator[Visit]:
    """A wide, light window."""
    with browser.new_context(**VIEWS["desk light"]) as context:
        yield Visit(context.new_page(), address)


@pytest.fixture(scope="module", params=PAGES)
def visit(request, browser, address) -> Iterator[Visit]:
    """Each page, opened once for all that is asked of it."""
    with browser.new_context(**VIEWS["desk light"]) as context:
        yield Visit(context.new_page(), address).go(request.param)


def test_nothing_is_missing_and_nothing_comes_from_elsewhere(visit):
    assert visit.problems == []


def test_mathematics_is_set(visit):
    unset = visit.find(
        "return [...article.querySelectorAll('.math')]"
        ".filter(it => !it.querySelector('mjx-container')).map(it => it.textContent)"
    )
    wrong = visit.find(
        "return [...article.querySelectorAll('mjx-merror, [data-mml-node=merror]')]"
        ".map(it => it.textContent)"
    )
    assert unset == []
    assert wrong == []


def test_pictures_are_there_and_described(visit):
    broken = visit.find(
        """
        const broken = [];
        for (const image of article.querySelectorAll('img')) {
          image.loading = 'eager';  // even what stands in for a figure that answers
          await image.decode().catch(() => {});
          if (image.naturalWidth === 0) broken.push(`not shown: ${image.src}`);
          if (!image.alt.trim() || /^[_.]*\\/?_images\\//.test(image.alt))
            broken.push(`not described: ${image.src}`);
          if (!image.getAttribute('width') || !image.getAttribute('height'))
            broken.push(`moves the page when it comes: ${image.src.slice(0, 80)}`);
        }
        return broken;
        """
    )
    assert broken == []


def test_nothing_holds_up_the_page(visit):
    """What is asked for before the first picture is one style sheet and the script that waits."""
    early, mathjax, formulas = visit.page.evaluate(
        """() => [
          performance.getEntriesByType('resource').filter(it => it.startTime <
            performance.getEntriesByName('first-contentful-paint')[0].startTime)
            .map(it => it.name.replace(/.*_static.|[?].*/g, '')),
          document.querySelectorAll('script[src*=mathjax]').length,
          document.querySelectorAll('article .math').length,
        ]"""
    )
    assert sorted(it for it in early if it.endswith((".css", ".js"))) == ["book.css", "late.js"]
    assert bool(mathjax) == bool(formulas)


def test_icons_are_drawn(visit):
    """Each has a width, which a character that the font lacks has too, so the font is asked."""
    lost = visit.page.evaluate(
        """async () => {
          await document.fonts.load('900 16px "Font Awesome 6 Free"', '\\uf0c9');
          return [...document.querySelectorAll('i[class*=fa-]')]
            .filter(it => !/["'][^"']["']/.test(getComputedStyle(it, '::before').content))
            .map(it => it.className);
        }"""
    )
    assert lost == []
    assert visit.page.evaluate("document.fonts.check('900 16px \"Font Awesome 6 Free\"')")


def test_films_play_and_are_described(visit):
    broken = visit.find(
        """
        const broken = [];
        for (const film of article.querySelectorAll('video')) {
          const name = film.getAttribute('aria-label');
          if (!name) broken.push('not described');
          if (!film.controls) broken.push(`no controls: ${name}`);
          if (!film.paused) broken.push(`starts by itself: ${name}`);
          await film.play().catch(error => broken.push(`${error}: ${name}`));
          film.pause();
          if (!(film.duration > 0 && film.videoWidth > 0)) broken.push(`empty: ${name}`);
        }
        return broken;
        """
    )
    assert broken == []


CAPTION = """
    const captionOf = it =>
      it.closest('figure')?.querySelector('figcaption') ??
      (it.closest('.cell')?.nextElementSibling?.matches('.caption')
        ? it.closest('.cell').nextElementSibling : null);
    """


def test_pictures_and_films_have_captions(visit):
    bare = visit.find(
        CAPTION + "return [...article.querySelectorAll('img, video')]"
        ".filter(it => !captionOf(it)?.textContent.trim())"
        ".map(it => it.alt || it.getAttribute('aria-label'))"
    )
    assert bare == []


def test_figures_offer_their_data(visit):
    without = visit.find(
        CAPTION + "return [...article.querySelectorAll('img')].map(captionOf)"
        ".filter(it => it && !it.querySelector('a.download')).map(it => it.textContent)"
    )
    assert without == []


def test_downloads_are_there(visit):
    files = visit.find("return [...article.querySelectorAll('a.download')].map(it => it.href)")
    for file in files:
        answer = visit.page.request.get(file)
        assert answer.ok, file
        assert answer.body(), f"empty: {file}"


def test_links_within_the_book_lead_somewhere(visit):
    links = visit.page.evaluate(
        "() => [...document.querySelectorAll('a[href]')].map(it => it.href)"
        ".filter(it => it.startsWith(location.origin))"
    )
    for link in {urldefrag(link).url for link in links}:
        assert visit.page.request.head(link).ok, link
    here = urldefrag(visit.page.url).url
    targets = {urldefrag(link).fragment for link in links if urldefrag(link).url == here} - {""}
    lost = visit.page.evaluate(
        "targets => targets.filter(it => !document.getElementById(decodeURIComponent(it)))",
        sorted(targets),
    )
    assert lost == []


def test_headings_of_tables_are_not_empty(visit):
    empty = visit.find(
        "return [...article.querySelectorAll('th')].filter(it => !it.textContent.trim()).length"
    )
    assert empty == 0


def test_the_focus_can_be_seen(desk):
    """Tabulator by tabulator, with nothing drawn outside of a box that clips it."""
    desk.go("book/02_q_learning.html")
    unseen = []
    for _ in range(60):
        desk.page.keyboard.press("Tab")
        unseen += desk.page.evaluate(
            """() => {
              const it = document.activeElement, style = getComputedStyle(it);
              const drawn = style.outlineStyle !== 'none' || style.boxShadow !== 'none';
              if (it.matches('video')) return [];  // its own controls show where they are
              const clipped = it.matches('.output, .cell_output, mjx-container')
                && parseFloat(style.outlineOffset) >= 0;
              return drawn && !clipped ? [] : [it.outerHTML.slice(0, 80)];
            }"""
        )
    assert unseen == []


def targets(page: Page) -> list[str]:
    """For each chapter, the first and the last place that the front page leads to."""
    links = page.evaluate(
        "() => [...document.querySelectorAll('article a[href*=\"#\"]')].map(it => it.href)"
    )
    pages: dict[str, list[str]] = {}
    for link in dict.fromkeys(links):
        address = urldefrag(link)
        if address.url != urldefrag(page.url).url:
            pages.setdefault(address.url, []).append(link)
    return [link for those in pages.values() for link in {those[0]: 0, those[-1]: 0}]


def slowly(seconds: float) -> Callable[[Route], object]:
    """A line on which everything takes so long."""
    return lambda route: (time.sleep(seconds), route.continue_())


@pytest.mark.parametrize("name", ["desk light", "phone light"])
def test_a_link_from_the_front_page_lands_on_its_figure(browser, address, name):
    """Also if pictures and formulas are slow: what comes above must not push the target away."""
    with browser.new_context(**VIEWS[name]) as context:
        page = context.new_page()
        visit = Visit(page, address).go("book/intro.html")
        links = targets(page)
        assert len(links) > 6
        for these, seconds in (("**/*.png", 0.05), ("**/mathjax/**", 0.3)):
            page.route(these, slowly(seconds))
        missed = {}
        for link in links:
            visit.go(link.removeprefix(f"{address}/"))
            page.wait_for_timeout(300)
            top, end = page.evaluate(
                """id => [
                  document.getElementById(id).getBoundingClientRect().top,
                  innerHeight + scrollY >= document.documentElement.scrollHeight - 2,
                ]""",
                urldefrag(link).fragment,
            )
            if not (0 <= top <= 120 or (end and 0 <= top < 900)):
                missed[link] = top
    assert missed == {}


def test_a_preview_says_so_on_every_page(visit):
    stamps = [path.name for path in SITE.glob(".complete-*-seeds")]
    assert len(stamps) == 1
    preview = stamps != [".complete-30-seeds"]
    banner = visit.page.locator(".bd-header-announcement", has_text="Preview")
    assert banner.count() == preview


@pytest.mark.parametrize("path", PAGES)
def test_the_page_fits_its_window(view, path):
    """Nothing sticks out at the side, and the reader's choice of light or dark is kept."""
    view.go(path)
    assert view.problems == []
    theme, wide, window = view.page.evaluate(
        "() => [document.documentElement.dataset.theme, document.documentElement.scrollWidth,"
        " document.documentElement.clientWidth]"
    )
    assert wide <= window
    assert theme == ("dark" if view.page.evaluate(DARK) else "light")


@pytest.mark.parametrize("path", PAGES)
def test_captions_and_formulas_fit_and_can_be_read(view, path):
    """A caption is in sight as a whole, and a formula not much smaller than the text."""
    wide, small = view.go(path).find(
        """
        const wide = [...article.querySelectorAll('table caption')]
          .filter(it => it.getBoundingClientRect().right > innerWidth).map(it => it.textContent);
        const small = [...article.querySelectorAll('mjx-container[display]')]
          .filter(it => parseFloat(getComputedStyle(it).fontSize) < 12.7).map(it => it.outerHTML);
        return [wide, small];
        """
    )
    assert (wide, small) == ([], [])


CONTRAST = """
    // Painted and read back: a colour may be written in many ways, color(srgb ...) among them.
    const canvas = new OffscreenCanvas(1, 1).getContext('2d', {willReadFrequently: true});
    const channels = colour => {
      canvas.clearRect(0, 0, 1, 1);
      canvas.fillStyle = colour;
      canvas.fillRect(0, 0, 1, 1);
      const [r, g, b, alpha] = canvas.getImageData(0, 0, 1, 1).data;
      return [r, g, b, alpha / 255];
    };
    const light = rgb => rgb.slice(0, 3).map(x => x / 255)
      .map(x => x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4)
      .reduce((sum, x, i) => sum + x * [0.2126, 0.7152, 0.0722][i], 0);
    const ground = it => {
      for (; it; it = it.parentElement) {
        const colour = channels(getComputedStyle(it).backgroundColor);
        if (colour[3] === 1) return colour;
      }
      return [255, 255, 255, 1];
    };
    const pale = [];
    for (const it of article.querySelectorAll('*')) {
      const own = [...it.childNodes].some(node => node.nodeType === 3 && node.data.trim());
      // What shows itself only when pointed at, or is no text, does not count.
      const furniture = it.closest(
        '.headerlink, .search-button__kbd-shortcut, script, style, video');
      if (!own || furniture || !it.checkVisibility({opacityProperty: true})) continue;
      const [one, other] = [channels(getComputedStyle(it).color), ground(it)].map(light);
      const ratio = (Math.max(one, other) + 0.05) / (Math.min(one, other) + 0.05);
      if (ratio < 4.5) pale.push(`${ratio.toFixed(1)}: ${it.textContent.trim().slice(0, 60)}`);
    }
    return pale;
    """


@pytest.mark.parametrize("path", PAGES)
def test_text_stands_out_from_its_ground(view, path):
    """At least 4.5 to 1, the Web Content Accessibility Guidelines' level AA."""
    assert view.go(path).find(CONTRAST) == []


def played(page: Page, place: str) -> Locator:
    """The figures that answer at a place."""
    return page.locator(f"#{place} [data-play]")


def offered(page: Page, place: str) -> pd.DataFrame:
    """The data that a figure's caption offers: in it, or below the cell."""
    captions = page.locator(f"#{place} figcaption, .cell:has(#{place}) + .caption")
    link = captions.locator("a.download").first.get_attribute("href")
    answer = page.request.get(urljoin(page.url, link))
    return pd.read_csv(StringIO(answer.text()))


def slide(host: Locator, value: int) -> None:
    host.locator("input[type=range]").evaluate(
        "(it, x) => { it.value = x; it.dispatchEvent(new Event('input')); }", value
    )


SEED_FIGURES = {
    10: "03_reinforce",
    11: "03_reinforce",
    12: "04_dqn",
    13: "04_dqn",
    14: "05_continuous_reinforce",
}


@pytest.mark.parametrize("number", SEED_FIGURES)
def test_every_seed_of_a_figure_shows_the_rows_it_offers(desk, number):
    desk.go(f"book/{SEED_FIGURES[number]}.html")
    panels, table = played(desk.page, f"figure-{number}"), offered(desk.page, f"figure-{number}")
    arms = [rows for _, rows in table.groupby("arm", sort=False)]
    assert panels.count() == len(arms)
    for panel, rows in zip(panels.all(), arms, strict=True):
        chips = panel.locator(".seed")
        seeds = rows.groupby("seed")
        assert chips.count() == len(seeds) > 1
        for chip in chips.all():
            chip.click()
            shown = panel.locator("[aria-live]").inner_text()
            seed = int(re.match(r"Seed (\d+): [a-z]", shown)[1])
            link = panel.locator("a[download]").get_attribute("href")
            drawn = pd.read_csv(StringIO(unquote(link.partition(",")[2]))).dropna()
            assert (drawn["seed"] == seed).all()
            steps = rows[rows["seed"] == seed].dropna().set_index("episode")["steps"]
            there = steps.loc[drawn["episode"]].to_numpy()
            np.testing.assert_allclose(drawn["steps"], there, rtol=6e-4)
    assert desk.page.locator(f"#figure-{number} .play-films video").count() >= 3
    assert desk.problems == []


@pytest.mark.parametrize(
    ("number", "first", "measures"),
    [
        *((f"s2-{n}", name, ("error", "unvisited", "earned", "lost")) for n, name in
          ((5, "step_size"), (6, "exploitation"), (7, "temperature"))),
    ],
)  # fmt: skip
def test_a_knob_of_chapter_2_shows_the_medians_of_its_data(desk, number, first, measures):
    desk.go("book/02_q_learning.html")
    (host,) = played(desk.page, f"figure-{number}").all()
    table = offered(desk.page, f"figure-{number}")
    medians = table.groupby(first)[list(measures)].median()
    learned = table["lost"].le(10).groupby(table[first]).mean()
    for place, value in enumerate(medians.index):
        slide(host, place)
        assert host.locator("output").inner_text().endswith(f"= {value:g}")
        shown = [it.replace("−", "-") for it in host.locator("strong").all_inner_texts()]
        expected = [*medians.loc[value], learned.loc[value]]
        np.testing.assert_allclose([*map(float, shown)], expected, rtol=1e-3, atol=1e-9)


def test_the_knob_of_chapter_5_shows_its_data(desk):
    desk.go("book/05_continuous_reinforce.html")
    (host,) = played(desk.page, "interactive-s5-1").all()
    table = offered(desk.page, "interactive-s5-1").pivot(
        index="arm", columns="measure", values="estimate"
    )
    for place, arm in enumerate(("as reported", "sigma 0.5", "sigma 1")):
        slide(host, place)
        shown = [it.replace("−", "-") for it in host.locator("strong").all_inner_texts()]
        expected = table.loc[arm, ["learned", "steps", "return", "early"]]
        for text, number in zip(shown, expected, strict=True):
            if text == "–":
                assert not np.isfinite(number)
            else:
                assert float(text) == pytest.approx(number, rel=1e-3)


def test_the_mean_action_can_be_read_off(desk):
    desk.go("book/05_continuous_reinforce.html")
    (host,) = played(desk.page, "figure-s5-5").all()
    table = offered(desk.page, "figure-s5-5").round({"position": 3, "velocity": 4})
    agents = [name for name in table.columns if name.startswith("mean action")]
    for place, agent in enumerate(agents):
        slide(host, place)
        host.locator(".play-chart").focus()
        desk.page.keyboard.press("ArrowLeft")
        desk.page.keyboard.press("ArrowUp")
        words = host.locator("[aria-live]").inner_text().replace("−", "-")
        value, x, y = map(float, re.findall(r"(?<= )-?[\d.]+(?=[ ,.])(?!\d)", words)[-3:])
        near = (table["position"] - x).abs() + 10 * (table["velocity"] - y).abs()
        assert value == pytest.approx(table.loc[near.idxmin(), agent], abs=1e-3)


def test_figures_that_answer_are_light(visit):
    """At most 250 kB a page: data and films; what they stand for was a picture before."""
    data = visit.find(
        "return [...article.querySelectorAll('[data-play] > script')].map(it => it.textContent)"
    )
    films = visit.find(
        "return [...article.querySelectorAll('.play-films video')].map(it => it.src)"
    )
    bodies = [visit.page.request.get(film).body() for film in films]
    assert sum(map(len, [*data, *bodies])) <= 250_000


def cells(page: Page, name: str) -> list[str]:
    """A column of the table of claims, from top to bottom."""
    return page.locator(f'table.claims td[data-label="{name}"]').all_inner_texts()


def first_number(text: str) -> float:
    """What a cell such as "1,234 [−∞, ∞]" begins with."""
    return float(text.split()[0].replace(",", "").replace("−", "-").replace("∞", "inf"))


def test_a_click_on_a_heading_sorts_the_claims(desk):
    desk.go("book/intro.html")
    buttons = desk.page.locator("table.claims th button")
    as_judged = cells(desk.page, "id")
    expected = pd.read_csv(CLAIMS, dtype=str)["id"].tolist()
    assert sorted(as_judged) == sorted(expected)
    for heading, key in (("measured", first_number), ("claim of 2018", str.casefold)):
        button = buttons.get_by_text(heading, exact=True)
        for backwards in (False, True):
            button.click()
            keys = [key(text) for text in cells(desk.page, heading)]
            if key is first_number:
                assert keys == sorted(keys, reverse=backwards)
            assert keys[0] == (max if backwards else min)(keys)
    button = buttons.get_by_text("id", exact=True)
    button.click()
    assert cells(desk.page, "id") == expected
    assert desk.page.locator("table.claims th[aria-sort]").count() == 1
    button.click()
    assert cells(desk.page, "id") == expected[::-1]


def test_the_caption_speaks_of_headings_where_there_are_some(view):
    view.go("book/intro.html")
    shown = [view.page.locator(f"table.claims {it}").is_visible() for it in ("thead", ".sorts")]
    assert shown == [view.page.viewport_size["width"] > 700] * 2


def test_a_claim_takes_one_line_on_a_desk_and_three_on_a_phone(view):
    """Except where the verdict depends on the reading, and both numbers are shown."""
    view.go("book/intro.html")
    wide = view.page.viewport_size["width"] > 700
    rows = view.page.locator("table.claims tbody tr:not(:has(.readings))")
    heights = rows.evaluate_all("rows => rows.map(row => row.getBoundingClientRect().height)")
    assert max(heights) < (30 if wide else 70)
    first = rows.first.locator("details")
    first.locator("summary").press("Enter")
    assert first.get_by_text("Decides: ").is_visible()


DARK = "() => matchMedia('(prefers-color-scheme: dark)').matches"


def test_search_finds_a_word(desk):
    desk.go("search.html?q=policy")
    desk.page.locator("ul.search li a").first.wait_for()
    assert desk.problems == []


def test_search_finds_nothing_where_nothing_is(desk):
    desk.go("search.html?q=xylophone")
    desk.page.get_by_text("did not match any documents").first.wait_for()
    assert desk.page.locator("ul.search li").count() == 0
