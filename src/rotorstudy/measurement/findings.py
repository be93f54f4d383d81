"""Findings: what is wrong with a record, where, and what to do. Every repair is reported as one."""

import re
from dataclasses import dataclass, field, fields

import numpy as np

SEVERITIES = ("error", "warning", "note")
ROUND_OFF = 1e-9  # of the largest harmonic
# severity: names (which of their kind): words, of every finding on records
TABLE = """
error: no phase reference: neither keyphasor nor phase mark times; the phase of the harmonics is undetermined. Record
    one of them
error: dead keyphasor: the keyphasor signal has no pulse above its noise that is shorter than 40 % of a revolution;
    check the connection and the channel name
error: too few revolutions (marks): phase marks seen: {count}; at least two are needed. Take a longer record, or check
    threshold_V
warning: keyphasor polarity: pulses last {duty:.0f} % of the time{asked}; the polarity is reversed, or threshold_V is
    wrong. Correct 'keyphasor: polarity' or 'threshold_V': the phase is off by up to half a revolution
warning: keyphasor polarity (both): it also has pulses of the other sign, {share:.0f} % as high; the {sign} ones are
    taken. State which is the mark by 'keyphasor: polarity'; an AC-coupled keyphasor has both
warning: missing pulses: {count} of {every}; counted without them
warning: doubled pulses: {count} extra pulses beside {marks} marks; left out
error: missing pulses (many), doubled pulses (many): {count} for {marks} regular pulses, too many to identify the marks.
    Check threshold_V
warning: keyphasor jitter: the marks scatter by {scatter:.2g} degrees about steady rotation (up to {usual:.2g} is
    usual), harmonic n by n times as much. The covariance includes it
error: speed label: labelled {label}, but the phase mark passes at {speed} ({off:+.3g} %, allowed
    {allowed:g} %); {hint}
warning: unusual speed: up to {fastest}, {times:.3g} times the lowest natural frequency of the rig ({lowest}). Of
    records check the time channel, 'time_unit' and 'sample_rate_Hz'; are stated speeds in another unit, such as rpm
    taken as rad/s, or in groups of digits, 1.004 for 1004?
warning: speed drift: the speed changes by {drift:+.2g} % over the record (up to {steady:g} % is steady); the
    harmonics are averages over these speeds. Take a shorter record, or cut it into pieces
warning: gaps: {part:.2g} % of the samples are missing (up to {most:g} % are tolerated); repair the record
warning: spikes: {count} samples, the first {value} at sample {first}, lie far outside the range of the others, are 0
    between larger ones, or repeat one value, and are taken as missing: a mark of the recorder for them, or dropouts
warning: time steps: time jumps by {steps:.3g} samples; the shaft angle is not affected. Check the recorder
error: dead probe (gaps): {missing:.3g} % of the samples are missing: the probe is dead or not connected
error: dead probe (constant): constant at {value}: the probe is dead or not connected; leave it out or repair it
error: dead probe (noise): no harmonic exceeds the noise, {noise} rms, where another probe of this node has {others}
    rms: the probe does not detect the shaft
warning: dead probe (left out): dead in every record, and left out of all of them. Repair it, or remove it from
    'probes:'
error: dead probe (predicted): no harmonic exceeds the noise at any speed, where the rig predicts {expected}: its
    probes do not detect the shaft, or the shaft does not vibrate
warning: weak probe: {own} rms where another probe of this node has {others}: check sensitivity and unit, and whether
    the probe detects the shaft
error: clipping: the signal is flat at its {side}, {value}: clipped by the probe or the recorder
error: too few samples: {samples} samples are too few for {count} harmonics; at least {needed} are needed
error: too few revolutions: {revolutions:.2f} revolutions; at least one is needed, six for a block covariance. Take a
    longer record
error: sampling rate: harmonic {highest} lies above the Nyquist frequency: it needs more than {needed} samples per
    revolution, and there are {there:.3g}, enough for harmonics up to {possible}. Sample faster, or leave the highest
    harmonics out
warning: few revolutions: {revolutions} whole revolutions; the scatter of repeat blocks needs {needed}, so the
    covariance is that of white noise at the noise floor. Take a longer record
warning: not steady: harmonic {n} changes steadily by {change} over the record; the covariance assumes a constant.
    Wait for a steady state, or shorten the record
warning: noise floor: no harmonic but the mean exceeds five times its standard deviation; take a longer record or
    another speed
error: reference signal: {problem}
note: run-up, coast-down: {kind} at {rate} rad/s per second, tracked at {count} of {every} speeds, from {first} to
    {last} rpm; any others depend on missing samples or marks, or on what came before or after the record. The
    transient of the sweep is removed from the harmonics
error: no speed: each of {every} speeds depends on missing samples or marks, or on what came before or after the
    record. Take a longer run-up without gaps
note: moving frequency: the transient that was removed near {at} rpm is about {share} % of the peak; if a natural
    frequency there rises or falls by a share g of the speed (a disc that tilts, an oil film), g times as much is left,
    which the stated uncertainty does not contain; a slower sweep leaves less
warning: sweep too fast: {beats}. They are removed, to about a percent; {slower}
error: sweep too fast (lost): {beats}, which cannot be removed; {slower}
warning: sweep too fast (vectors): the vectors beat as in a sweep at {rate} rad/s per second, {times} times the square
    of the half-power bandwidth: near and beyond the critical speed they are not steady, and their peak lies beyond
    it. Give the record in time, whose transient can be removed, or use lower speeds
note: critical speeds: {each}; the residual is {residual}
warning: non-synchronous line: a line at {hertz:.5g} Hz, {order:.4f} times the speed{across}: forward {forward},
    backward {backward} at node {node}, {sense}. {kind}. It is fitted together with the harmonics and kept out of
    their covariance; the diagnosis does not explain it
error: units (still): no vibration in any harmonic; check the probes and their columns
error: units (impossible): vibration of {size} rms is {what}; check the units ({confused})
warning: units: vibration of {size} rms where the rig predicts {expected}; check the units ({confused}), and the
    unbalance that the rig states
warning: probe gap: the mean is {off} from the static position that the rig predicts, while the shaft vibrates by
    {rms} rms. Does it include the gap of the probes? It would be taken for a preload. Zero the probes with the shaft
    at rest, leave 0 out of 'measurement: harmonics:', or give the rig the effect sensor_gap
error: sense of rotation: backward 1X is {ratio:.3g} times forward or more at every node: reversed rotation, the
    probes of all nodes swapped or of the wrong sign, or phases of a table that are leads instead of lags, or the
    other way round. Correct 'rotation:', the probes or 'table_phase:'. {remedy}
error: swapped probes: backward 1X is {ratio:.3g} times forward, but not at the other nodes: the two probes of this
    node are swapped, or one has the wrong sign. {remedy}
warning: probe angles: its probes are within {apart:.2g} degrees of one line by 'measurement: probes:', and show one
    direction together. Correct the angles; they must be in degrees
warning: sensitivity: sensitivity_V_per_m = {given:g} of '{channel}' is outside {low:g} to {high:g}, in which
    displacement probes lie. Convert it: 200 mV/mil or 7.874 V/mm are 7874
warning: one signal: +1X and -1X are equal at every speed, so its probes show one signal. Was a cable connected or a
    column copied twice?
warning: phase mark: {n:+d}X is more than {times:g} times 1X at every speed and node: does the mark pass once in {turns}
    revolutions? Check the channel of the keyphasor and its threshold_V, or correct the speeds of a table
note: single probe: node {nodes} has a single probe: only its motion along the probe is measured, and only the model
    separates forward from backward. A second probe there would measure the orbit
note: repeats: {records} records at {speeds} speeds; repeats are averaged, and scatter by up to {size}, as expected
    from the noise of each
warning: repeats differ: {records} records at {speeds} speeds; repeats are averaged, and scatter by up to {size}
    (rms), {times:.3g} times what is expected from the noise of each ({p}); look for what changes from run to run. The
    scatter is in the covariance
note: slow roll subtracted: the vectors at {speeds} (forward 1X: {sizes}) are subtracted at all other speeds: runout,
    and the bow of the shaft at rest, of which only what the speed adds is left
warning: slow roll above a critical speed: the rig has a critical speed at {critical}, below the slow roll at {fastest}:
    1X is vibration there and not runout; roll more slowly, or state no slow roll
note: AC coupling: the mean is below {share} of the vibration at every speed and node, but the oil films move the
    journals with the speed: the records are AC-coupled, or their mean was taken off. 0X is left out, and nothing is
    said of static loads. Record the gap voltage of the probes to have it
note: harmonics not read: the table also has {others}; state 'measurement: harmonics:' to read them
warning: missing readings: {lacking} of {count} speeds are left out, as readings are missing: at {rpm:.6g} rpm{again},
    {n}X of {place}{others}. A harmonic that is missing at many speeds is better left out of 'measurement: harmonics:'
warning: speed not used: the rig file states a speed of '{name}', which is not given, and none of '{record}'. Is one
    meant for the other? Correct 'measurement: {section}:'
note: columns not read: neither the first speed nor readings of a probe and a whole harmonic, such as 'DE X 1X Amp
    (mil pp)': {columns}
warning: not stated: neither its header nor the rig file states whether amplitudes are peak, peak to peak or rms, or
    phases lags or leads; taken is {taken}. State it under 'measurement:'
warning: phases in radians: the phases in degrees are all below {largest:.2g}; are they in radians? Call the column
    phase_rad then
warning: readings of zero: {count} amplitudes are exactly 0 between larger ones: at {rpm:.6g} rpm, {n}X of {place}. Is a
    missing reading written so? Leave its cells empty
note: rounding only: the covariance is that of the rounding of the printed digits. A table does not contain the noise
    of the measurement; where that exceeds the rounding, intervals are too narrow. State 'measurement: table_noise_m:'
    if it is known
note: last digits: the last digits are those of the cells as printed; give columns '..._last_digit' if zeros were
    dropped
"""


def words_of(table):
    """{name (which of its kind): (severity, words)} of a text like the TABLE, where a row may be of several."""
    rows = (row.split(": ", 2) for row in re.sub(r"\n +", " ", table.strip()).split("\n"))
    return {key: (severity, words) for severity, keys, words in rows for key in keys.split(", ")}


SAID = words_of(TABLE)


@dataclass(frozen=True)
class Finding:
    """One thing worth knowing: an "error" excludes the record, a "warning" is to be checked, a "note" is neither."""

    severity: str
    name: str
    where: str
    text: str

    def __str__(self):
        return " ".join(f"{self.severity}: {self.where}: {self.name}: {self.text}".split())  # a name may break


def told(key, where, severity=None, *, table=SAID, **values):
    """The Finding of a row of the TABLE, or of other words; with its values, and its severity where that depends."""
    usual, words = table[key]
    return Finding(severity or usual, key.partition(" (")[0], str(where), words.format(**values))


def errors_among(findings):
    """The findings that are errors."""
    return [finding for finding in findings if finding.severity == "error"]


def worst_first(findings):
    """Findings in the order error, warning, note; otherwise as found."""
    return sorted(findings, key=lambda finding: SEVERITIES.index(finding.severity))


def _fact(unit, long_name):
    return field(default=np.nan, metadata={"unit": unit, "long_name": long_name})


@dataclass
class NodeFacts:
    """Harmonics of one node in one record, and facts about it; NaN for what a table does not contain."""

    amplitude: np.ndarray | None = None  # (harmonic,) complex m; None after an error
    covariance: np.ndarray | None = None  # (component, component) m^2
    forward_1x: float = _fact("m", "amplitude of harmonic 1")
    backward_1x: float = _fact("m", "amplitude of harmonic -1")
    noise_std: float = _fact("m", "standard deviation of the noise of a sample of x or y")
    variance_shrinkage: float = _fact("1", "weight of the common variance in the covariance")
    correlation_shrinkage: float = _fact("1", "weight of zero correlation in the covariance")
    lines: tuple = ()  # Line of each spectral line that is not synchronous; they are in no other quantity
    blocks: np.ndarray | tuple = ()  # (block, harmonic) complex, m; empty if there were too few revolutions


@dataclass
class RecordFacts:
    """What one record, or one speed of a run-up or a table, says: facts, NaN where unknown, and the rest below."""

    where: str
    nodes: dict[int, NodeFacts]
    label: float = _fact("rad/s", "stated speed")
    measured_speed: float = _fact("rad/s", "mean speed from the phase marks")
    revolutions: float = _fact("1", "whole revolutions used")
    blocks: float = _fact("1", "repeat blocks used for the covariance")
    samples_per_revolution: float = _fact("1", "samples per revolution")
    speed_drift: float = _fact("1", "relative change of speed over the record")
    jitter: float = _fact("rad", "standard deviation of the phase marks")
    mark_resolution: float = _fact("rad", "resolution of the phase marks, limited by the sampling")
    missing_pulses: float = _fact("1", "missing keyphasor pulses")
    doubled_pulses: float = _fact("1", "extra keyphasor pulses")
    missing_samples: float = _fact("1", "fraction of missing samples")
    findings: list[Finding] = field(default_factory=list)
    speed: float = np.nan  # rad/s; NaN after an error
    record: object = None  # clean Record, if it is wanted
    dead: frozenset = frozenset()  # {(node, channel)} of dead probes
    directions: dict = field(default_factory=dict)  # {node: rad} of the nodes with a single probe
    is_tracked: bool = False  # whether it is of a run-up or coast-down


def facts_of(kind):
    """[(name, unit, long name)] of the facts of RecordFacts or NodeFacts."""
    return [(one.name, *one.metadata.values()) for one in fields(kind) if one.metadata]


def node_facts(amplitude, covariance, harmonics, noise_std=np.nan, shrinkage=(np.nan, np.nan), *more):
    """NodeFacts of the amplitudes (harmonic,) of a node, m; round-off of the largest one is zero."""
    sizes = np.abs(amplitude)
    sizes = np.where(sizes <= ROUND_OFF * sizes.max(initial=0.0), 0.0, sizes)
    size = dict(zip((int(n) for n in harmonics), sizes, strict=True))
    return NodeFacts(amplitude, covariance, size.get(1, np.nan), size.get(-1, np.nan), noise_std, *shrinkage, *more)
