"""The pages as they are read: `make docs` names the folder that it has written, and runs this over it."""

from __future__ import annotations

import functools
import os
import re
from pathlib import Path
from urllib.parse import unquote

import pytest

from dforce.forces import REGISTRY

SITE = Path(os.environ.get("DFORCE_SITE", ""))
if not os.environ.get("DFORCE_SITE"):
    pytest.skip("DFORCE_SITE names no folder with the built pages", allow_module_level=True)
PAGES = sorted(path for path in SITE.rglob("*.html") if "_static" not in path.parts)
SMALL, LAPTOP, LARGE, PHONE = 400, 1366, 1920, 390  # pixels across


@functools.cache
def text(path):
    return path.read_text(encoding="utf-8")


@functools.cache
def anchors(path):
    return set(re.findall(r'\bid="([^"]+)"', text(path)))


def test_there_are_pages():
    assert len(PAGES) > 50


def test_every_link_within_the_pages_leads_somewhere():
    dead = []
    for page in PAGES:
        for link in re.findall(r'<a\b[^>]*\bhref="([^"]+)"', text(page)):
            if re.match(r"[a-z]+:", link):
                continue
            file, _, anchor = link.partition("#")
            target = (page.parent / unquote(file)).resolve() if file else page.resolve()
            if not target.exists() or (anchor and target.suffix == ".html" and unquote(anchor) not in anchors(target)):
                dead.append(f"{page.relative_to(SITE)}: {link}")
    assert dead == []


def test_no_initials_are_taken_for_the_letters_of_a_list():
    assert [page.name for page in PAGES if re.search(r'<ol class="(?:upper|lower)(?:alpha|roman)', text(page))] == []


def test_no_source_is_listed_as_an_error():
    assert [page.name for page in PAGES if re.search("<strong>Sources?<", text(page))] == []


@pytest.fixture(scope="module")
def browser():
    from playwright.sync_api import sync_playwright

    from dforce.gui.window.server import find_browser

    program = find_browser()
    if program is None:
        pytest.skip("there is no browser of Chromium's family")
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=program, args=["--no-sandbox"])
        yield started
        started.close()


TOO_WIDE = """() => {
  const article = document.querySelector('.bd-article-container')
  if (!article) return []
  const edge = article.getBoundingClientRect().right + 1
  const found = []
  for (const box of article.querySelectorAll('div.highlight pre, table')) {
    const place = box.getBoundingClientRect()
    if (place.width && (place.right > edge || box.scrollWidth > box.clientWidth + 1)) found.push(box.textContent.slice(0, 60))
  }
  return found
}"""


BROKEN = """() => {
  const found = []
  const texts = document.createTreeWalker(document.querySelector('.bd-article') ?? document.body, NodeFilter.SHOW_TEXT)
  for (let text = texts.nextNode(); text; text = texts.nextNode()) {
    if (!text.parentElement.closest('td, th') || text.parentElement.closest('math')) continue
    for (const word of text.data.matchAll(/[\\p{L}\\p{N}]+(?:\\.\\p{N}+)*/gu)) {
      const range = document.createRange()
      range.setStart(text, word.index)
      range.setEnd(text, word.index + word[0].length)
      const lines = new Set([...range.getClientRects()].map((box) => Math.round(box.top)))
      if (lines.size > 1) found.push(word[0])
    }
  }
  return found
}"""


@pytest.fixture(scope="module")
def looks(browser):
    """What is wrong on each page: boxes that run out on a laptop, words that are broken in tables at three widths."""
    page, found = browser.new_page(), {"too wide": {}, "broken": {}}
    for path in PAGES:
        name = str(path.relative_to(SITE))
        page.goto(path.resolve().as_uri())
        for width in (SMALL, LAPTOP, LARGE):
            page.set_viewport_size({"width": width, "height": 800})
            if broken := page.evaluate(BROKEN):
                found["broken"][name, width] = broken[:5]
            if width == LAPTOP and (boxes := page.evaluate(TOO_WIDE)):
                found["too wide"][name] = boxes
    return found


def test_no_code_and_no_table_runs_out_of_its_box_on_a_laptop(looks):
    assert looks["too wide"] == {}


def test_no_word_in_a_table_is_broken(looks):
    assert looks["broken"] == {}


def test_no_page_is_wider_than_a_phone(browser):
    page = browser.new_page(viewport={"width": PHONE, "height": 800})
    wide = {}
    for name in ("index", "how-to", "glossary", "cite", "paper/figure_3", "forces/dlvo", "reference/commands"):
        page.goto((SITE / f"{name}.html").resolve().as_uri())
        if (pixels := page.evaluate("document.documentElement.scrollWidth")) > PHONE:
            wide[name] = pixels
    assert wide == {}


@pytest.mark.parametrize(
    ("query", "page"),
    [
        ("setpoint", "Glossary"), ("set point", "Glossary"), ("how to cite", "How to cite"), ("citation", "How to cite"),
        ("install", "Install"), ("hertz", "hertz"), ("exit codes", "Commands"), ("bimodal", "Glossary"),
    ],
)  # fmt: skip
def test_the_search_finds(browser, query, page):
    tab = browser.new_page()
    tab.goto(f"{(SITE / 'search.html').resolve().as_uri()}?q={query.replace(' ', '+')}")
    tab.wait_for_selector("#search-results p.search-summary", timeout=20_000)
    tab.wait_for_function("document.querySelectorAll('#search-results li').length > 0", timeout=10_000)
    assert any(page in found for found in tab.locator("#search-results li > a").all_inner_texts())


def test_a_search_from_disk_shows_excerpts_with_the_word(browser):
    tab = browser.new_page()
    tab.goto(f"{(SITE / 'search.html').resolve().as_uri()}?q=bootstrap")
    tab.wait_for_selector("#search-results p.context", timeout=20_000)
    assert any("bootstrap" in text.lower() for text in tab.locator("#search-results p.context").all_inner_texts())


def test_the_header_has_five_parts_and_nothing_under_more(browser):
    page = browser.new_page(viewport={"width": LAPTOP, "height": 800})
    page.goto((SITE / "index.html").resolve().as_uri())
    parts = page.locator(".bd-header .navbar-nav > li").all_inner_texts()
    assert [part.strip() for part in parts] == ["Start", "Tasks", "Models", "Theory", "Reference"]


def test_every_picture_of_the_start_page_and_of_the_forces_is_drawn(browser):
    page = browser.new_page(viewport={"width": LAPTOP, "height": 800})
    for name, pictures in (("index", 7), ("forces/index", len(REGISTRY))):
        page.goto((SITE / f"{name}.html").resolve().as_uri())
        sizes = page.evaluate("[...document.querySelectorAll('.bd-article img')].map((one) => one.naturalWidth)")
        assert len(sizes) == pictures and min(sizes) > 100
    for model in REGISTRY:
        page.goto((SITE / "forces" / f"{model}.html").resolve().as_uri())
        assert page.evaluate("document.querySelector('.force-figure img')?.naturalWidth ?? 0") > 500, model
