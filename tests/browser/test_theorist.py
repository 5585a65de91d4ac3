"""A theorist asks: what does my own force do to amplitude and phase, beside DMT?"""

from __future__ import annotations

from playwright.sync_api import expect
from served import violations

import dforce as df
from dforce.core.arrays import Array


def amplitude(case: df.Case) -> Array:
    """Return the amplitude (nm) on approach."""
    return df.run(case)["amplitude"].isel(direction=0, tone=0).values * 1e9


def shown(window, wanted: Array) -> None:
    """Wait until the chart has a line of amplitudes."""
    window.page.wait_for_function(
        """(wanted) => document.querySelector(".df-main .df-plot")._fullData.some((trace) => trace.meta === "amplitude"
            && trace.y.length === wanted.length && trace.y.every((y, n) => Math.abs(y - wanted[n]) < 1e-5))""",
        arg=wanted.tolist(),
    )


def test_a_theorist_writes_a_law_sees_its_force_and_compares_it_with_dmt(visit):
    window = visit()
    page = window.page
    dmt = window.start("figure-3-air")
    page.get_by_role("button", name="Keep", exact=True).click()
    page.locator(".df-chip").first.wait_for()
    page.get_by_role("button", name="remove DMT").click()
    page.locator(".df-card").wait_for(state="detached")

    page.get_by_role("button", name="Add a force").click()
    page.get_by_role("dialog", name="add a force").wait_for()
    assert violations(page, "region", within=".df-forces") == []
    page.get_by_role("searchbox", name="search the forces").fill("own")
    page.get_by_role("menuitem", name="Own law").click()
    law = page.get_by_label("The force", exact=True)
    expect(law).to_be_focused()
    example = amplitude(dmt.replace(forces=[df.forces.Custom(**df.forces.Custom.example)]))
    shown(window, example)

    law.fill("")
    page.get_by_text("The force is empty").wait_for()
    names = page.get_by_role("group", name="names for the law")
    names.get_by_role("button", name="P1: ").click()
    law.press_sequentially("*(")
    page.get_by_text("is not an expression").wait_for()  # while it is typed
    names.get_by_role("button", name="d: distance").click()
    before = window.revision(".df-force")
    law.press_sequentially("<a0)")
    page.get_by_text("has the condition 'd < a0' in place of a number").wait_for()
    with window.redrawn(".df-force"):
        law.fill("-P1*exp(-max(d, a0)/P2) + P3*sqrt(R)*indentation**1.5")
    assert window.revision(".df-force") > before
    assert violations(page, within=".df-law") == []
    page.get_by_text("Press Enter to compute with this law").wait_for()
    shown(window, example)  # as long as Enter is not pressed
    law.press("Enter")

    own = df.forces.Custom(
        **{**df.forces.Custom.example, "law": "-P1*exp(-max(d, a0)/P2) + P3*sqrt(R)*indentation**1.5"}
    )
    wanted = amplitude(dmt.replace(forces=[own]))
    shown(window, wanted)
    kept = amplitude(dmt)
    assert max(abs(kept - wanted)) > 1e-2
    assert any(len(line) == len(kept) and max(abs(line - kept)) < 1e-5 for line in window.lines("amplitude"))
