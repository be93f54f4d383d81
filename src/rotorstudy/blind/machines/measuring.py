"""The measuring chain, from the steady motion to a record; angles count from x in the sense of the spin."""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Probe:
    """A displacement probe at `angle` (rad, meant; really `angle_error` beyond), of a gain over the nominal one."""

    angle: float
    gain: float = 1.0
    angle_error: float = 0.0
    runout: dict = field(default_factory=dict)  # complex amplitude (m) of exp(j k angle) of the surface, by k >= 1
    reversed: bool = False

    def reading(self, x, y, turning):
        """What it shows of a motion along x and y, m; turning(k, amplitude) : that of a harmonic of its runout."""
        where = self.angle + self.angle_error
        seen = np.cos(where) * x + np.sin(where) * y
        for k, amplitude in self.runout.items():
            seen = seen + turning(k, amplitude)
        return self.gain * seen * (-1 if self.reversed else 1)


@dataclass(frozen=True)
class Chain:
    """What the recorder adds to all channels of a machine."""

    rate: float  # samples a second
    revolutions: float = 40.0  # length of the record at the lowest speed
    noise: float = 0.0  # standard deviation, m, white
    coloured_noise: float = 0.0  # likewise, 1/f in power
    quantum: float = 0.0  # of the converter, m
    swapped: tuple = ()
    phase_offset: float = 0.0  # the mark's true angle beyond the one of the rig file, rad
    delay: float = 0.0  # of the displacement channels against the keyphasor, s
    amplitude_scatter: float = 0.0  # run to run, relative
    phase_scatter: float = 0.0  # run to run, rad
    jitter: float = 0.0  # of the speed over the mean speed, 1/f
    sensor_angle: float = np.pi / 2  # of the keyphasor's sensor, rad
    mark_angle: float = 0.0  # of the mark from the shaft's reference line, rad
    pulse_width: float = 0.2


def coloured(rng, shape):
    """Noise of power 1/f along the last axis, of mean zero and standard deviation one (on average)."""
    count = shape[-1]
    weight = np.zeros(count // 2 + 1)
    weight[1:] = 1 / np.sqrt(np.arange(1, len(weight)))
    spectrum = (rng.normal(size=(*shape[:-1], len(weight))) + 1j * rng.normal(size=(*shape[:-1], len(weight)))) * weight
    return np.fft.irfft(spectrum, count, axis=-1) * count / (2 * np.sqrt(np.sum(weight**2)))


def shaft_angle(rng, chain, speed, time):
    """Angle of the shaft over time, rad: a random start, and a slow wander of the speed."""
    wander = chain.jitter * coloured(rng, time.shape) if chain.jitter else np.zeros(len(time))
    rate = speed * (1 + wander)
    step = time[1] - time[0]
    start = rng.uniform(0, 2 * np.pi)
    return start + np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 2) * step]), rate


def at_angle(periodic, angle, orders):
    """Values of signals (..., steps) over one revolution at any angles, from their harmonics up to `orders`."""
    spectrum = np.fft.rfft(periodic, axis=-1) / periodic.shape[-1]
    turn = np.exp(1j * np.outer(np.arange(1, orders + 1), angle))
    return spectrum[..., :1].real + 2 * (spectrum[..., 1 : orders + 1] @ turn).real


def keyphasor(angle, chain):
    """Volts of a pulse from 0 to 5 each time the mark passes the sensor, with flanks a tenth of its width."""
    passing = angle + chain.mark_angle + chain.phase_offset - chain.sensor_angle
    away = np.abs(np.mod(passing + np.pi, 2 * np.pi) - np.pi)
    return 5.0 * np.clip((chain.pulse_width / 2 - away) / (0.1 * chain.pulse_width) + 0.5, 0.0, 1.0)


def record(rng, steady, nodes, probes, chain, zero=None, orders=24):
    """Time, s, displacement (speeds, nodes, 2, samples), m, keyphasor, V, mean speeds, rad/s; zero : of the probes."""
    time = np.arange(round(chain.revolutions * 2 * np.pi / steady.speed.min() * chain.rate)) / chain.rate
    count = len(steady.speed)
    out = np.empty((count, len(nodes), 2, len(time)))
    pulses, means = np.empty((count, len(time))), np.empty(count)
    orders = min(orders, len(steady.angle) // 2 - 1)
    zero = np.zeros(steady.displacement.shape[-1]) if zero is None else zero
    for s in range(count):
        angle, rate = shaft_angle(rng, chain, steady.speed[s], time)
        means[s], pulses[s] = (angle[-1] - angle[0]) / time[-1], keyphasor(angle, chain)
        seen = angle - rate * chain.delay

        def turning(k, amplitude, seen=seen):
            return (amplitude * np.exp(1j * k * seen)).real

        swing, shift = 1 + chain.amplitude_scatter * rng.normal(), chain.phase_scatter * rng.normal()
        planes = np.array([steady.displacement[s][:, 4 * node : 4 * node + 2].T for node in nodes])
        rests, turned = planes.mean(axis=-1, keepdims=True), at_angle(planes, seen + shift, orders)
        for i, node in enumerate(nodes):
            motion = rests[i] + swing * (turned[i] - rests[i])
            motion -= zero[4 * node : 4 * node + 2, None]
            for channel, probe in enumerate(probes[node]):
                out[s, i, channel] = probe.reading(*motion, turning)
    for i, node in enumerate(nodes):
        if node in chain.swapped:
            out[:, i] = out[:, i, ::-1].copy()
    out += chain.noise * rng.normal(size=out.shape) + chain.coloured_noise * coloured(rng, out.shape)
    if chain.quantum:
        out = np.round(out / chain.quantum) * chain.quantum
    return {"time": time, "displacement": out, "keyphasor": pulses, "speed": means}


def expected_harmonics(steady, nodes, probes, chain, harmonics, zero=None):
    """Harmonics (speeds, harmonics, nodes), m, of records without noise as one reads them who knows what was meant."""
    harmonics, zero = np.asarray(harmonics), np.zeros(steady.displacement.shape[-1]) if zero is None else zero
    out = np.empty((len(steady.speed), len(harmonics), len(nodes)), complex)
    late = np.exp(-1j * harmonics * (chain.phase_offset + steady.speed[:, None] * chain.delay))

    def turning(k, amplitude):
        return amplitude / 2 * (harmonics == k) + np.conj(amplitude) / 2 * (harmonics == -k)

    for i, node in enumerate(nodes):
        xy = steady.displacement[:, :, 4 * node : 4 * node + 2] - zero[4 * node : 4 * node + 2]
        lines = np.mean(xy[:, :, None] * np.exp(-1j * np.outer(steady.angle, harmonics))[None, :, :, None], axis=1)
        readings = [probe.reading(lines[..., 0], lines[..., 1], turning) * late for probe in probes[node]]
        readings = readings[::-1] if node in chain.swapped else readings
        meant = np.array([[np.cos(probe.angle), np.sin(probe.angle)] for probe in probes[node]])
        x, y = np.einsum("dp,psh->dsh", np.linalg.inv(meant), np.array(readings))
        out[:, :, i] = x + 1j * y
    return out


def surface_runout(rng, probe_angles, size, orders=3):
    """Runout of one surface, a dict a probe: one profile, falling as 1/k, later at a probe further round."""
    profile = {k: size / k * (rng.normal() + 1j * rng.normal()) / np.sqrt(2) for k in range(1, orders + 1)}
    return [{k: value * np.exp(-1j * k * angle) for k, value in profile.items()} for angle in probe_angles]
