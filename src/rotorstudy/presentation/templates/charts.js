// Charts of the pages, drawn by uPlot (axes, scales, cursor): zoom by dragging, back by a double click, values under the pointer.
{
const NEAR = 30, STEPS = 180, DECADES = 4, dark = matchMedia("(prefers-color-scheme: dark)"), charts = [], groups = {};
const css = name => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
const colour = series => series.colour === 6 ? css("--text") : css(`--c${series.colour}`);
const short = value => value == null ? "" : String(+value.toPrecision(4));
const extent = values => values.reduce(([low, high], one) => one == null ? [low, high] : [Math.min(low, one), Math.max(high, one)], [Infinity, -Infinity]);

// spec: x, y: {label, unit, log, ticks: {values: labels}, range}; hover: "x" (every curve at the speed of the pointer) or "near";
// series: {label, colour, x, y, line, mark, dash, low, high, note}; equal: scales of both axes; down: y points down;
// lines: [{x | y, label}]; bands: [[from, to]]; circles: [radius]; group: charts with one cursor and one zoom along x
function chart(place, first, height = 260) {
  let spec = first, zoomed = null, plot = null, moving = false;
  const told = document.createElement("output"), hint = document.createElement("span"), dot = document.createElement("i");
  dot.className = "dot";
  hint.className = "note";
  const box = document.createElement("div");
  place.replaceChildren(box, told, hint);
  const shown = () => zoomed || whole();
  function whole(window) {
    const inside = (s, i) => !window || (s.x[i] >= window[0] && s.x[i] <= window[1]);
    const xs = spec.x.range || extent(spec.series.flatMap(s => s.x).concat((spec.circles || []).flatMap(r => [-r, r])));
    let ys = spec.y.range || extent(spec.series.flatMap(s => [s.y, s.low, s.high].flatMap(v => (v || []).filter((_, i) => inside(s, i)))).concat((spec.circles || []).flatMap(r => [-r, r])).filter(v => !spec.y.log || v > 0));
    if (!Number.isFinite(ys[0])) ys = spec.y.log ? [1, 10] : [0, 1];
    if (spec.y.log) ys[0] = Math.max(ys[0], ys[1] / 10 ** DECADES);
    if (!spec.y.range) ys = spec.y.log ? pad(ys.map(Math.log10), 0.05).map(v => 10 ** v) : pad(ys, 0.06);
    return {x: window || (spec.x.range ? xs : spec.equal ? pad(xs, 0.06) : pad(xs, 0)), y: ys};
  }
  const pad = ([low, high], share) => { const more = share * (high - low) || (low === high ? Math.abs(low) || 1 : 0); return [low - more, high + more]; };
  function squared({x, y}) {  // one unit has the same length along both axes
    if (!spec.equal || !plot) return {x, y};
    const unit = Math.max((x[1] - x[0]) / plot.bbox.width, (y[1] - y[0]) / plot.bbox.height);
    const about = ([low, high], size) => [(low + high - unit * size) / 2, (low + high + unit * size) / 2];
    return {x: about(x, plot.bbox.width), y: about(y, plot.bbox.height)};
  }
  function rescale() {
    const {x, y} = squared(shown());
    plot.batch(() => { plot.setScale("x", {min: x[0], max: x[1]}); plot.setScale("y", {min: y[0], max: y[1]}); });
    hint.textContent = zoomed ? " double-click: whole range" : "";
    place.dataset.zoomed = zoomed ? "yes" : "no";
  }
  function draw(u) {
    const c = u.ctx, b = u.bbox, px = devicePixelRatio, X = v => u.valToPos(v, "x", true);
    const floor = u.scales.y.min, Y = v => u.valToPos(spec.y.log ? Math.max(v, floor) : v, "y", true);
    c.save(); c.beginPath(); c.rect(b.left, b.top, b.width, b.height); c.clip();
    c.fillStyle = css("--band");
    for (const [from, to] of spec.bands || []) c.fillRect(X(from), b.top, X(to) - X(from), b.height);
    c.font = `${11 * px}px sans-serif`; c.textAlign = "left"; c.textBaseline = "alphabetic"; c.strokeStyle = c.fillStyle = css("--quiet"); c.lineWidth = px;
    for (const line of spec.lines || []) {
      c.setLineDash([4 * px, 3 * px]); c.beginPath();
      if (line.y == null) { c.moveTo(X(line.x), b.top); c.lineTo(X(line.x), b.top + b.height); if (line.label) c.fillText(line.label, X(line.x) + 3 * px, b.top + 12 * px); }
      else { c.moveTo(b.left, Y(line.y)); c.lineTo(b.left + b.width, Y(line.y)); if (line.label) c.fillText(line.label, b.left + 4 * px, Y(line.y) - 4 * px); }
      c.stroke();
    }
    for (const r of spec.circles || []) { c.beginPath(); c.ellipse(X(0), Y(0), Math.abs(X(r) - X(0)), Math.abs(Y(r) - Y(0)), 0, 0, 7); c.stroke(); }
    for (const s of spec.series) {
      c.strokeStyle = c.fillStyle = colour(s); c.lineWidth = (s.width || 1.6) * px; c.setLineDash((s.dash || []).map(d => d * px));
      if (s.line) {
        c.beginPath(); let pen = false;
        s.x.forEach((x, i) => { if (s.y[i] == null) { pen = false; return; } c[pen ? "lineTo" : "moveTo"](X(x), Y(s.y[i])); pen = true; });
        c.stroke();
      }
      c.setLineDash([]);
      s.x.forEach((x, i) => {
        if (s.y[i] == null || (spec.y.log && s.y[i] < floor)) return;
        const [a, o] = [X(x), Y(s.y[i])], r = (s.size || 3) * px;
        if (s.low) { c.beginPath(); c.moveTo(a, Y(s.low[i])); c.lineTo(a, Y(s.high[i])); c.stroke(); }
        if (s.stem) { c.beginPath(); c.moveTo(a, b.top + b.height); c.lineTo(a, o); c.stroke(); }
        if (!s.mark) return;
        c.beginPath();
        if (s.mark === "square") c.rect(a - r, o - r, 2 * r, 2 * r); else if (s.mark === "triangle") { c.moveTo(a, o - r); c.lineTo(a + r, o + r); c.lineTo(a - r, o + r); c.closePath(); } else c.arc(a, o, r, 0, 7);
        if (s.hollow) c.stroke(); else c.fill();
      });
      c.font = `${11 * px}px sans-serif`;
      for (const [i, text] of Object.entries(s.texts || {})) c.fillText(text, X(s.x[i]) + 4 * px, Y(s.y[i]) - 4 * px);
    }
    c.restore();
  }
  const unit = axis => axis.unit ? ` ${axis.unit}` : "";
  function hover(u) {
    const {left, top} = u.cursor;
    dot.style.display = "none";
    if (left == null || left < 0) { told.textContent = legend(); return; }
    const x = u.posToVal(left, "x");
    if (spec.hover === "x") {
      told.textContent = `${short(x)}${unit(spec.x)}: ` + spec.series.filter(s => s.x.length).map(s => {
        let i = 0; s.x.forEach((one, k) => { if (Math.abs(one - x) < Math.abs(s.x[i] - x)) i = k; });
        return `${s.label} ${short(s.y[i])}`; }).join(", ") + unit(spec.y);
      if (!moving && spec.group) for (const other of groups[spec.group]) if (other.plot !== u && other.plot) other.follow(x);
      return;
    }
    let best = null, least = NEAR ** 2;
    spec.series.forEach(s => s.x.forEach((one, i) => {
      if (s.y[i] == null) return;
      const [a, o] = [u.valToPos(one, "x"), u.valToPos(s.y[i], "y")], far = (a - left) ** 2 + (o - top) ** 2;
      if (far < least) { least = far; best = {s, i, a, o}; }
    }));
    if (!best) { told.textContent = legend(); return; }
    const {s, i, a, o} = best, across = spec.x.ticks ? s.name?.[i] ?? short(s.x[i]) : `${short(s.x[i])}${unit(spec.x)}`;
    told.textContent = `${s.label}${s.note ? `, ${s.note[i]}` : ""}: ` + (s.text ? s.text[i] : s.speed ? `${short(s.speed[i])} ${spec.speed}, ${short(Math.hypot(s.x[i], s.y[i]))}${unit(spec.x)} lagging by ${((Math.atan2(s.y[i], s.x[i]) * 180 / Math.PI + 360) % 360).toFixed(1)}°` : `${across}, ${short(s.y[i])}${unit(spec.y)}`);
    dot.style.cssText = `display: block; left: ${a - 5}px; top: ${o - 5}px`;
  }
  const legend = () => "";
  function zoom(u) {
    const {left, top, width, height: tall} = u.select;
    if (width < 5 && tall < 5) return;
    const ends = (from, size, key) => [u.posToVal(from, key), u.posToVal(from + size, key)].sort((a, b) => a - b);
    const x = width < 5 ? shown().x : ends(left, width, "x");
    if (spec.hover === "x") for (const one of groups[spec.group] || [me]) one.window(x);
    else { zoomed = {x, y: tall < 5 ? shown().y : ends(top, tall, "y")}; rescale(); }
    u.setSelect({left: 0, top: 0, width: 0, height: 0}, false);
  }
  const decades = (low, high) => {
    const powers = Array.from({length: 60}, (_, i) => i - 30), steps = high / low > 100 ? [1] : [1, 2, 5];
    return powers.flatMap(p => steps.map(step => step * 10 ** p)).filter(v => v >= low && v <= high);
  };
  const axis = (given, size) => ({
    label: given.label + (given.unit ? ` (${given.unit})` : ""), labelSize: 20, size, font: "12px sans-serif", labelFont: "12px sans-serif",
    stroke: () => css("--text"), grid: {stroke: () => css("--line"), width: 1}, ticks: {stroke: () => css("--line"), width: 1},
    ...(given.log ? {splits: (u, _, low, high) => decades(low, high), values: (u, all) => all.map(v => v != null && +v.toPrecision(3) < 1e-3 ? v.toExponential(0) : short(v))} :
        given.ticks ? {splits: () => given.ticks.values, values: () => given.ticks.labels} : {values: (u, all) => all.map(v => v == null ? "" : short(v))}),
  });
  function make(width) {
    plot?.destroy();
    const options = {
      width, height, legend: {show: false},
      cursor: {points: {show: false}, drag: {x: true, y: spec.hover !== "x", setScale: false}, bind: {dblclick: () => () => back()}},
      scales: {x: {time: false, auto: false}, y: {auto: false, distr: spec.y.log ? 3 : 1, dir: spec.down ? -1 : 1}},
      axes: [axis(spec.x, 34), axis(spec.y, 58)],
      series: [{}, {paths: () => null, points: {show: false}}],
      hooks: {draw: [draw], setCursor: [hover], setSelect: [zoom]},
    };
    const start = whole();
    plot = new uPlot(options, [start.x, start.y], box);
    plot.over.append(dot);
    plot.root.setAttribute("role", "img");
    plot.root.setAttribute("aria-label", spec.title || spec.y.label);
    me.plot = plot;
    rescale();
  }
  function back() { for (const one of groups[spec.group] || [me]) one.window(null); }
  const me = {
    plot: null,
    update(given) { const log = spec.y.log !== given.y.log; spec = given; zoomed = null; if (plot) { if (log) make(box.clientWidth); else rescale(); plot.redraw(); } },
    window(x) { zoomed = x && whole(x); if (plot) rescale(); },
    follow(x) { moving = true; plot.setCursor({left: plot.valToPos(x, "x"), top: 10}); moving = false; },
    redraw() { plot?.redraw(false, true); },
  };
  if (spec.group) (groups[spec.group] ||= []).push(me);
  charts.push(me);
  const fit = () => {
    if (box.clientWidth < 50) return;  // in what is folded
    if (!plot) make(box.clientWidth);
    else if (plot.width !== box.clientWidth) { plot.setSize({width: box.clientWidth, height}); rescale(); }
  };
  new ResizeObserver(() => requestAnimationFrame(fit)).observe(box);
  return me;
}

// a set of charts of one page place, with a choice among `views` (such as nodes) where there are several
function set(place, data) {
  const form = document.createElement("form"), select = document.createElement("select"), row = document.createElement("div");
  data.views.forEach((view, i) => select.add(new Option(view.name, i)));
  row.className = "panels";
  if (data.views.length > 1) { const label = document.createElement("label"); label.append("Show ", select); form.append(label); }
  place.append(form, key(data.views[0].charts[0].series), row);
  const made = data.views[0].charts.map(spec => { const one = document.createElement("div"); row.append(one); return chart(one, spec, data.height + (spec.equal ? 80 : 0)); });
  form.addEventListener("input", () => data.views[select.value].charts.forEach((spec, i) => made[i].update(spec)));
  form.addEventListener("submit", event => event.preventDefault());
}
function key(series) {
  const line = document.createElement("p");
  line.className = "note key";
  for (const s of series) {
    const one = document.createElement("span"), sign = document.createElement("b");
    sign.textContent = s.drawn ? `${s.drawn} ` : s.line ? (s.dash ? "┄ " : "— ") : s.mark === "square" ? "■ " : s.mark === "triangle" ? "▲ " : "● ";
    sign.className = `c${s.colour}`;
    one.append(sign, s.label);
    line.append(one, " ");
  }
  return line;
}

// orbit, waveform, full spectrum and residual of one node at the speed that a reader chooses
function view(place, data) {
  const form = place.querySelector("form"), row = document.createElement("div"), order = data.harmonic.map((_, i) => i).sort((a, b) => data.harmonic[a] - data.harmonic[b]);
  row.className = "panels";
  place.append(row);
  // in a waveform x is the thick line, y the thin one
  const marks = ["circle", "square", "triangle"], dashes = [[2, 2], [6, 3], null];
  const part = (name, s, k, h) => [data.values[name].real[s][k][h], data.values[name].imag[s][k][h]];
  const motion = (name, s, k) => Array.from({length: STEPS + 1}, (_, i) => data.harmonic.reduce(([x, y], n, h) => {
    if (!n) return [x, y];
    const [re, im] = part(name, s, k, h), a = n * (2 * Math.PI * i / STEPS + data.mark), [c, d] = [Math.cos(a), Math.sin(a)];
    return [x + re * c - im * d, y + re * d + im * c];
  }, [0, 0]));
  const turns = Array.from({length: STEPS + 1}, (_, i) => 360 * i / STEPS);
  function specs(s, k) {
    const raw = data.signals?.[s]?.[k], lines = data.names.map(([name, label, hue], i) => ({label, hue, dash: data.names.length > 2 ? dashes[i] : null, at: motion(name, s, k)}));
    if (raw) lines.length = 0;
    const orbit = lines.flatMap(({label, hue, dash, at}) => [
      {label, colour: hue, line: true, dash, x: at.map(p => p[1]), y: at.map(p => p[0]), note: turns.map(a => `${short(a)}° after the mark`)},
      {label: `${label}, phase mark`, colour: hue, mark: "circle", size: 4, x: [at[0][1]], y: [at[0][0]]}]);
    const wave = lines.flatMap(({label, hue, dash, at}) => [0, 1].map(axis => ({label: `${label}, ${"xy"[axis]}`, colour: hue, line: true, dash, width: axis ? 0.8 : 1.8, x: turns, y: at.map(p => p[axis])})));
    if (raw) {
      orbit.push({label: "measured", colour: 0, line: true, x: raw.y, y: raw.x}, {label: "phase mark", colour: 1, mark: "circle", size: 4, x: raw.marks.map(i => raw.y[i]), y: raw.marks.map(i => raw.x[i])});
      wave.push(...["x", "y"].map((axis, i) => ({label: axis, colour: i, line: true, width: i ? 0.8 : 1.8, x: raw.angle, y: raw[axis]})));
    }
    const place_of = (h, i, count) => order.indexOf(h) + (count > 1 ? 0.22 * (i - (count - 1) / 2) : 0);
    const size = (name, h) => Math.hypot(...part(name, s, k, h));
    const name = data.harmonic.map(n => `${n}X`), ticks = {values: order.map((_, i) => i), labels: order.map(h => name[h])};
    const across = {label: "harmonic (backward < 0 < forward)", ticks, range: [-0.6, order.length - 0.4]};
    const told = (value, std) => std == null ? `${short(value)} ${data.unit}` : `${short(value)} ± ${short(std)} ${data.unit}`;
    const spectrum = data.names.map(([one, label, hue], i) => {
      const values = data.harmonic.map((_, h) => size(one, h)), std = data.std[one];
      return {label, colour: hue, mark: marks[i], x: data.harmonic.map((_, h) => place_of(h, i, data.names.length)), y: values, note: name, text: values.map((v, h) => told(v, std?.[s][k][h])),
              ...(std ? {low: values.map((v, h) => Math.max(v - 2 * std[s][k][h], v / 20)), high: values.map((v, h) => v + 2 * std[s][k][h])} : {})};
    });
    const found = [
      {title: `Orbit of node ${data.node[k]}`, equal: true, down: true, hover: "near", x: {label: "y", unit: data.unit}, y: {label: "x, down", unit: data.unit}, series: orbit, circles: data.clearance[data.node[k]] ? [data.clearance[data.node[k]]] : []},
      {title: "Waveform", hover: "near", x: {label: "shaft angle after the mark", unit: "°"}, y: {label: "displacement", unit: data.unit}, series: wave},
      {title: "Full spectrum", hover: "near", x: across, y: {label: "amplitude", unit: data.unit, log: true}, series: spectrum}];
    if (data.sigma) found.push({title: "Residual", hover: "near", x: across, y: {label: "residual: standard deviations", log: true}, lines: [{y: 1, label: "noise alone"}],
      series: data.sigma.map(([label, hue, values], i) => ({label, colour: hue, mark: marks[i + 1], x: data.harmonic.map((_, h) => place_of(h, i, 2)), y: values[s][k].map(v => Math.max(v, 0.1)), note: name, text: values[s][k].map(v => `${short(v)} standard deviations`)}))});
    return found;
  }
  const now = () => [+form.speed.value, +form.node.value], first = specs(...now());
  const made = first.map((spec, i) => { const one = document.createElement("figure"), text = document.createElement("b"); text.textContent = spec.title; const inner = document.createElement("div"); one.append(text, inner); row.append(one); return {text, ...{chart: chart(inner, spec, 280)}}; });
  row.before(key(data.names.map(([, label, hue], i) => ({label, colour: hue, drawn: data.names.length > 2 ? ["┈●", "╌■", "─▲"][i] : "─●"}))));
  const show = () => {
    form.querySelector("output").value = data.speed[now()[0]];
    specs(...now()).forEach((spec, i) => { made[i].text.textContent = spec.title; made[i].chart.update(spec); });
  };
  form.addEventListener("input", show);
  form.addEventListener("submit", event => event.preventDefault());
  form.querySelector("output").value = data.speed[now()[0]];
}
for (const place of document.querySelectorAll("[data-charts]")) {
  const data = JSON.parse(place.querySelector("script[type='application/json']").textContent);
  place.classList.add("live");
  (data.views ? set : view)(place, data);
}
dark.addEventListener("change", () => charts.forEach(one => one.redraw()));
}
