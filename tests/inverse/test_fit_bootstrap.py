"""Errors by fits to redrawn residuals: those of the noise that is there, whatever the free part says of it."""

import fitted_curves as fc
import numpy as np
import pytest
from fitted_curves import H

import dforce as df
from dforce.inverse.fitting import bootstrap
from dforce.inverse.fitting.minimize import Objective


def correlated(count: int, correlation: float) -> np.ndarray:
    """Return noise whose neighbors are correlated, (count, 2)."""
    draw = np.random.default_rng(5).normal(size=(count, 2))
    for row in range(1, count):
        draw[row] = correlation * draw[row - 1] + np.sqrt(1.0 - correlation**2) * draw[row]
    return draw


def test_blocks_are_as_long_as_neighbors_are_alike() -> None:
    assert bootstrap.block_length([correlated(4000, 0.0)], 0.0) == 1
    # three times the length over which it falls to 1/e: 3 / ln(1 / 0.6) = 5.9
    assert bootstrap.block_length([correlated(4000, 0.6)], 0.0) == 6
    assert bootstrap.block_length([correlated(4000, 0.0)], 0.6) == 6
    assert bootstrap.block_length([np.ones((50, 2))], 0.0) == 10  # five blocks at least


@pytest.mark.long
def test_the_bootstrap_finds_the_noise_that_is_there() -> None:
    data = fc.data_of("air")
    data = data.assign_attrs(amplitude_error=2.0 * data.attrs["amplitude_error"], phase_error=0.6)
    fit = df.fit(fc.case_of("air"), data, free=[H], nuisance=["zc_offset"], search=False, bootstrap=100)
    ratio = fit["bootstrap_error"] / fit["error"]
    # of 100 draws half the range of the middle 68 % scatters by a tenth
    assert ratio.values == pytest.approx([0.5, 0.5], rel=0.35)
    assert fit.attrs["bootstrap_block"] == 1 and fit.sizes["draw"] == 100
    lines = df.fit_report(fit).splitlines()
    assert "errors by bootstrap: 100 fits to redrawn residuals one by one" in lines


def test_a_prior_is_redrawn_and_a_fit_done_again_draws_the_same() -> None:
    settings = {"nuisance": ["zc_offset"], "search": False, "bootstrap": 20}
    fit = df.fit(fc.case_of("air"), fc.data_of("air"), free=[H], priors={"cantilever.Q": (255.0, 5.0)}, **settings)
    assert float(fit["bootstrap_value"].sel(parameter="cantilever.Q").std()) == pytest.approx(5.0, rel=0.4)
    again = df.fit_again(fit)
    np.testing.assert_array_equal(fit["bootstrap_value"], again["bootstrap_value"])


def test_a_stop_keeps_the_draws_that_are_done(monkeypatch: pytest.MonkeyPatch) -> None:
    class Stopped(Objective):
        calls = 0

        def minimize(self, *given: float) -> object:
            Stopped.calls += 1
            if Stopped.calls == 4:
                raise KeyboardInterrupt
            return super().minimize(*given)

    monkeypatch.setattr(bootstrap, "Objective", Stopped)
    fit = df.fit(fc.case_of("air"), fc.data_of("air"), free=[H], search=False, bootstrap=30)
    assert fit.sizes["draw"] == 3 and fit.attrs["interrupted"] == 1


def test_too_few_draws_are_refused() -> None:
    with pytest.raises(df.ParameterError, match="bootstrap = 5 fits are too few for an error; write 0, or 20 or more"):
        df.fit(fc.case_of("air"), fc.data_of("air"), free=[H], bootstrap=5)
