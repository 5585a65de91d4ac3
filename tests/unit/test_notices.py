"""What dForce says beside results reaches who listens, once."""

import dforce as df
from dforce import notices


def test_a_listener_hears_the_same_sentence_once_in_a_row_and_each_new_one():
    heard = []
    with df.listening(heard.append):
        for text in ("compiling one", "compiling one", "compiling another", "compiling another"):
            notices.announce(text)
    assert heard == ["compiling one", "compiling another"]
