"""What a combination of forces has no use for is left out of its functions, and nothing else."""

import ast
import textwrap

import pytest

from dforce.kernel.specialize import fold

NONE, SOME = (
    {"memory_size": 0, "latch_count": 0, "mode_count": 1},
    {"memory_size": 3, "latch_count": 1, "mode_count": 2},
)
FUNCTION = """
def f(y, log):
    size = memory_size()
    total = 2 * mode_count() + size
    if size:
        log.append("memory")
    elif latch_count():
        log.append("latch")
    for k in range(memory_size()):
        total += y[k]
    for k in range(mode_count()):
        total += 10 * y[k]
    last = -1 if memory_size() else size
    return total + last
"""


def folded(sizes, text=FUNCTION):
    [function] = ast.parse(textwrap.dedent(text)).body
    return fold(function, sizes)


@pytest.mark.parametrize("sizes", [NONE, SOME, SOME | {"memory_size": 0}])
def test_a_folded_function_returns_and_does_the_same(sizes):
    outcomes = []
    for tree in (folded({}), folded(sizes)):
        space = {name: (lambda value=value: value) for name, value in sizes.items()}
        exec(ast.unparse(ast.fix_missing_locations(tree)), space)
        log = []
        outcomes.append((space["f"]([1.0, 2.0, 4.0], log), log))
    assert outcomes[0] == outcomes[1]


def test_what_no_force_has_is_left_out():
    text = ast.unparse(ast.fix_missing_locations(folded(NONE)))
    assert "append" not in text
    assert "_size" not in text
    assert text.count("for ") == 1
    assert "append('latch')" in ast.unparse(ast.fix_missing_locations(folded(SOME | {"memory_size": 0})))


def test_a_name_that_changes_is_not_taken_for_a_number():
    changing = "def f():\n    n = memory_size()\n    n += 1\n    return n"
    assert ast.unparse(folded(NONE, changing)).endswith("n = 0\n    n += 1\n    return n")
