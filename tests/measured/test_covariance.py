"""The stated covariance of measured harmonics is their scatter: over many records with noise that is known."""

import numpy as np
import pytest
from machine import HARMONICS, NOISE, TIME, mark_times, model, records, write, write_rig
from scipy.signal import lfilter
from scipy.stats import chi2

from rotorstudy import measured_response, read_measurement
from rotorstudy.measurement.angle_fit import fit_harmonics
from rotorstudy.measurement.harmonics import estimate, shrunk_covariance, with_phase_noise
from rotorstudy.measurement.spectrum import components
from rotorstudy.response.series import rotating_basis

PER_TURN, TRIALS, LISTED = 40, 400, np.array([0, 1, -1, 2, -2, 3, -3])
SIZE = np.array([3, 10, 1, 2, 0.5, 0.3, 0.2]) + 1j


def noise(kind, generator, samples):
    both = generator.normal(size=(2, samples + 500))
    if kind == "white":
        return (both[0] + 1j * both[1])[500:]
    # remembers a sixth of a turn: power at 0X is 30 times that at 3X, and blocks are independent all the same
    red = lfilter([1], [1, -0.86], both)
    return (red[0] + 1j * red[1])[500:]


def monte_carlo(kind, turns):
    """Errors (trial, component), stated covariances and numbers of blocks of records of whole turns."""
    generator = np.random.default_rng(7)
    angle = 2 * np.pi * np.arange(turns * PER_TURN) / PER_TURN
    clean = SIZE @ np.exp(1j * np.multiply.outer(LISTED, angle))
    found = [estimate(clean + noise(kind, generator, len(angle)), angle, turns, LISTED) for _ in range(TRIALS)]
    errors = components(np.array([one.amplitude - SIZE for one in found])[..., None])[..., 0]
    return errors, np.array([one.covariance for one in found]), {len(one.blocks) for one in found}


@pytest.mark.parametrize("kind", ["white", "red"])
@pytest.mark.parametrize(("turns", "blocks"), [(4, 0), (8, 8), (100, 25)])
def test_the_stated_variances_are_the_scatter(kind, turns, blocks):
    """400 trials know each variance to 7 %, so four of these are allowed; and the squares of errors over the stated
    covariance exceed their number a little, as it is estimated: Student's 1 + 2 / (blocks - 3) at worst."""
    errors, stated, counts = monte_carlo(kind, turns)
    assert counts == {blocks}
    scatter = np.mean(errors**2, axis=0)
    ratio = np.mean(np.diagonal(stated, axis1=1, axis2=2), axis=0) / scatter
    if kind == "red" and blocks == 0:
        # negative control, and why a warning says so: a floor taken as white is wrong for red noise
        assert ratio[0] < 0.5
        return
    # red noise: of very unequal variances the large are stated low and the small high, more so with few blocks; and it
    # remembers a sixth of a block at 0X, which blocks of one turn take for independent
    low, high = (0.72, 1.28) if kind == "white" else {8: (0.5, 2), 25: (0.75, 1.5)}[blocks]
    mean = np.tile(LISTED == 0, 2)
    assert np.all((ratio > low) & (mean | (ratio < high))), ratio
    # a few blocks cannot exclude noise slower than a record, which adds to 0X and is half as likely beforehand
    assert np.all(ratio[mean] < (high if blocks == 0 else 8)), ratio
    squares = np.einsum("ti,tij,tj->t", errors, np.linalg.inv(stated), errors) / errors.shape[1]
    assert 0.6 < squares.mean() < 1.08 * (1 + (2 / (blocks - 3) if blocks else 0)), squares.mean()


@pytest.mark.parametrize(("line", "gap"), [(0.0, False), (0.0, True), (2.0, False)])
def test_a_drift_of_the_mean_leaks_into_no_harmonic(line, gap):
    """Half the amplitude of 1X over 60 turns. Its leak into harmonic n, its slope over n, is what the fit alone has."""
    generator = np.random.default_rng(3)
    angle = 2 * np.pi * np.arange(60 * PER_TURN) / PER_TURN
    drift = 5e-3 * (1 + 2j) * (angle - angle.mean())
    signal = SIZE @ np.exp(1j * np.multiply.outer(LISTED, angle)) + line * np.exp(0.437j * angle) + drift
    signal += 0.02 * noise("white", generator, len(angle))
    signal[900 : 900 + 90 * gap] = np.nan
    for wanted in (LISTED, LISTED[1:]):  # with and without 0X, whose covariance shows the drift
        own = np.isin(LISTED, wanted)
        held = signal - (0 if own[0] else np.nanmean(signal))
        found = estimate(held, angle, 60, wanted)
        moving = wanted != 0
        off = np.abs(found.amplitude - SIZE[own])[moving]
        std = np.sqrt(np.diag(found.covariance).reshape(2, -1).sum(axis=0))[moving]
        assert (off < 4 * std).all() and (std < 2e-3).all()
        there = np.isfinite(held)
        alone = fit_harmonics(held[there], angle[there], wanted).amplitude
        assert np.abs(alone - SIZE[own])[wanted == 1] > 5 * std[wanted[moving] == 1]  # the negative control
        assert len(found.lines) == (line > 0)


@pytest.mark.parametrize("per_turn", [PER_TURN, 20.37])
@pytest.mark.parametrize("gap", [0, 9])
def test_harmonics_that_nobody_asked_for_are_no_scatter(per_turn, gap):
    """Whether the samples at the ends of blocks fall to one or the next is round-off if a turn has whole samples."""
    others, generator = np.array([5, -5, 7, -4]), np.random.default_rng(8)
    angle = 2 * np.pi * np.arange(int(40 * per_turn)) / per_turn
    moved = angle + 1e-10 * generator.normal(size=len(angle))
    signal = SIZE @ rotating_basis(angle, 1.0, LISTED) + noise("white", generator, len(angle))
    signal[450 : 450 + gap] = np.nan
    added = np.array([20, 10j, 10, -10]) @ rotating_basis(angle, 1.0, others)
    for turned in (angle, moved):
        alone, found = estimate(signal, turned, 40, LISTED), estimate(signal + added, turned, 40, LISTED)
        assert np.diag(found.covariance) == pytest.approx(np.diag(alone.covariance), rel=0.05)
        std = np.sqrt(np.diag(alone.covariance).reshape(2, -1).sum(axis=0))
        assert (np.abs(found.amplitude - alone.amplitude) < 0.1 * std).all()
        there = np.isfinite(signal)
        plain = fit_harmonics((signal + added)[there], turned[there], [*LISTED, *others])
        assert found.noise_std == pytest.approx(np.std(plain.residual) / np.sqrt(2), rel=0.01)


def test_few_blocks_give_neither_a_singular_nor_a_wild_covariance():
    """Seven draws of 22 components: rank six at most, but shrunk to within a factor of four of the true, white one."""
    generator = np.random.default_rng(5)
    for _ in range(50):
        draws = generator.normal(size=(7, 22))
        assert np.linalg.matrix_rank(np.cov(draws.T)) == 6  # negative control
        values = np.linalg.eigvalsh(shrunk_covariance(draws)[0])
        assert values.min() > 1 / 4 and values.max() < 4


def test_a_clear_correlation_and_unequal_variances_stay():
    generator = np.random.default_rng(6)
    true = np.array([[100.0, 9.0, 0], [9.0, 1.0, 0], [0, 0, 1.0]])
    found, (variances, correlations) = shrunk_covariance(generator.multivariate_normal(np.zeros(3), true, 32))
    assert variances < 0.2 and correlations < 0.2
    assert found[0, 0] > 50 and found[0, 1] / np.sqrt(found[0, 0] * found[1, 1]) > 0.7  # of 0.9


def test_errors_of_the_phase_mark_are_in_the_covariance():
    """Draws of a turned amplitude: covariance n^2 times that of the mark, and all harmonics together."""
    turn = np.random.default_rng(1).normal(size=20000) * 0.01
    drawn = components((SIZE * np.exp(1j * LISTED * turn[:, None]))[..., None])[..., 0]
    stated = with_phase_noise(SIZE, np.zeros((14, 14)), LISTED, 1e-4)
    assert np.abs(np.cov(drawn.T) - stated).max() < 0.03 * np.abs(stated).max()  # 20000 draws: 1 % of a variance


def test_whole_records_with_noise_and_jitter(tmp_path):
    """From files: 5 records with noise on probes and marks; squares of their errors over the stated covariance."""
    true = measured_response(model(), [80.0], HARMONICS)
    rig = write_rig(tmp_path / "rig.yaml")
    total, without, count = 0.0, 0.0, 5 * 2 * 2 * len(HARMONICS)
    for seed in range(5):
        (record,) = records(seed, [80.0])
        marks = mark_times(record)
        marks = marks + 0.02 / 80 * np.random.default_rng(1000 + seed).normal(size=len(marks))
        key = 5 * np.exp(-0.5 * ((record.time[:, None] - marks) * 80 / 0.1) ** 2).sum(axis=1)
        found = read_measurement(write("csv", tmp_path, record, key=key), rig).spectrum
        off = components(found.amplitude - true)[0]
        for s in range(2):
            total += off[:, s] @ np.linalg.solve(found.covariance[0, s], off[:, s])
            without += np.sum(off[:, s] ** 2) / (NOISE**2 / len(TIME))  # the white noise alone
    # the mark's error is common to both nodes, so 5 values fewer are independent; covariances of 30 blocks: 2 / 27
    low, high = chi2.ppf([0.001, 0.999], count - 5) / count
    assert 0.9 * low < total / count < 1.1 * high, total / count
    assert without / count > 1.15, without / count  # negative control: the jitter matters


def pink(generator, samples):
    """Complex noise of power 1/f down to one period in 32 records, cut from a longer record."""
    frequency = np.fft.rfftfreq(32 * samples)
    power = np.zeros(len(frequency))
    power[1:] = 1 / frequency[1:]
    draws = generator.normal(size=(2, 2, len(frequency)))
    x, y = np.fft.irfft((draws[0] + 1j * draws[1]) * np.sqrt(power), axis=-1)[:, :samples] * np.sqrt(samples)
    return x + 1j * y


def hum(generator, turns, angle, cycles):
    """A line along x, between `cycles` (in the record) away from a harmonic, three times the noise of a sample."""
    order = generator.integers(0, 4) + generator.choice([-1, 1]) * generator.uniform(*cycles) / turns
    return noise("white", generator, len(angle)) + 3 * np.cos(order * angle + generator.uniform(0, 6))


@pytest.mark.parametrize(
    ("kind", "turns", "most"),
    [
        ("white", 16, 0.01), ("pink", 16, 0.08), ("pink", 40, 0.03),
        ("hum", 16, 0.02), ("hum beside a harmonic", 16, 0.12),
    ],
)  # fmt: skip
def test_false_alarms_of_the_chi_square(kind, turns, most):
    """Of 200 records of noise few are rejected at 0.1 %, short ones tell 1/f less; without slow noise half are."""
    generator = np.random.default_rng(3)
    angle = 2 * np.pi * np.arange(turns * PER_TURN) / PER_TURN
    alarms, without = 0, 0
    for _ in range(200):
        if kind == "pink":
            added = pink(generator, len(angle))
        elif kind == "white":
            added = noise("white", generator, len(angle))
        else:
            added = hum(generator, turns, angle, (0.3, 1) if "beside" in kind else (3.1, 0.4 * turns))
        found = estimate(SIZE @ rotating_basis(angle, 1.0, LISTED) + added, angle, turns, LISTED)
        off = components((found.amplitude - SIZE)[:, None])[:, 0]
        alarms += off @ np.linalg.solve(1.1 * found.covariance, off) > chi2.isf(1e-3, len(off))
        scatter, _ = shrunk_covariance(np.concatenate([found.blocks.real, found.blocks.imag], axis=1))
        without += off @ np.linalg.solve(1.1 * scatter / len(found.blocks), off) > chi2.isf(1e-3, len(off))
    assert alarms / 200 <= most, alarms / 200
    slow = kind in ("pink", "hum beside a harmonic")
    assert (without / 200 > 0.3) == slow, without / 200  # negative control: the blocks alone do not show it


def test_samples_that_are_locked_to_the_shaft_fall_into_blocks_whatever_the_rounding():
    """Ten samples a revolution, the first of each on the edge of a block; without room for round-off a third of it."""
    generator, turns = np.random.default_rng(3), 90
    angle, (x, y) = 2 * np.pi * np.arange(10 * turns) / 10, generator.normal(size=(2, 10 * turns))
    moved = angle + 1e-13 * generator.normal(size=len(angle))
    exact, moved = (estimate(x + 1j * y, one, turns, LISTED).covariance for one in (angle, moved))
    assert moved == pytest.approx(exact, abs=1e-9 * exact.max())
