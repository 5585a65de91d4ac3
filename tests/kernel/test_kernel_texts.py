"""Texts of composed modules on disk: the same as composed anew, and never used where they may not be."""

from __future__ import annotations

import pytest

import dforce as df
from dforce import kernel
from dforce.kernel import cache, texts
from dforce.kernel.codegen import compose
from dforce.solvers.compiled import ENTRIES


class Composer:
    """Counts how often it is asked for its text."""

    def __init__(self, text: str = "text") -> None:
        self.text, self.asked = text, 0

    def __call__(self) -> str:
        self.asked += 1
        return self.text


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch):
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(tmp_path))
    return tmp_path / cache.TEXTS


def forces(name: str = "figure-3-air") -> tuple[df.Force, ...]:
    return df.example(name).problem.forces


def test_a_text_is_composed_once_and_is_then_read():
    composer = Composer(compose(1, forces(), ENTRIES))
    first = texts.remembered((1, 1), forces(), composer)
    assert texts.remembered((1, 1), forces(), composer) == first == composer.text
    assert composer.asked == 1


@pytest.mark.parametrize("parts", [(2, 1), (1, 2), (1, 1, True)])
def test_another_combination_has_another_text(parts):
    texts.remembered((1, 1), forces(), Composer("one"))
    assert texts.remembered(parts, forces(), Composer("another")) == "another"


def test_other_forces_or_other_sources_have_another_text(monkeypatch):
    texts.remembered((1, 1), forces(), Composer("one"))
    assert texts.remembered((1, 1), forces("figure-5"), Composer("another")) == "another"
    monkeypatch.setattr(texts, "sources", lambda: "changed")
    assert texts.remembered((1, 1), forces(), Composer("anew")) == "anew"


@pytest.mark.parametrize("place", [2, 3, 4])  # of a force's signature, behind type and law
def test_every_number_that_decides_a_kernel_decides_its_text(place, monkeypatch):
    seen, known = [], kernel.signature
    problem = df.example("figure-5").problem

    def remembered(parts, forces, compose):
        seen.append(repr(parts))
        return compose()

    def other(force):
        return tuple("other" if i == place else part for i, part in enumerate(known(force)))

    monkeypatch.setattr(texts, "remembered", remembered)
    monkeypatch.setattr(kernel, "_KERNELS", {})
    kernel.load(problem, ENTRIES)
    monkeypatch.setattr(kernel, "signature", other)
    kernel.load(problem, ENTRIES)
    assert seen[0] != seen[1]


def test_laws_from_elsewhere_are_composed_each_time():
    custom = df.Case(
        cantilever=df.Cantilever(f0="50 kHz", k=1.0, Q=100.0), drive=df.Drive(A0="8 nm"), tip=df.Tip(radius="5 nm"),
        forces=[df.forces.Custom(law="-1e-29 / max(d, a0)**2")],
    ).problem.forces  # fmt: skip
    composer = Composer()
    for _ in range(2):
        texts.remembered((1, 1), custom, composer)
    assert composer.asked == 2


def test_a_damaged_text_is_composed_anew_and_cleared_with_the_kernels(folder):
    texts.remembered((1, 1), forces(), Composer("good"))
    [file] = folder.iterdir()
    file.write_bytes(file.read_bytes()[:-2] + b"xx")
    assert texts.remembered((1, 1), forces(), Composer("good")) == "good"
    df.clear_kernel_cache()
    assert not folder.exists()


def test_a_folder_that_cannot_be_written_does_no_harm(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("no folder")
    monkeypatch.setenv("DFORCE_CACHE_DIR", str(blocked))
    assert texts.remembered((1, 1), forces(), Composer("composed")) == "composed"


def test_the_oldest_texts_go_when_there_are_too_many(folder, monkeypatch):
    monkeypatch.setattr(texts, "MOST_TEXTS", 3)
    for number in range(5):
        texts.remembered((number,), forces(), Composer())
    assert len(list(folder.iterdir())) == 3
