// Learning curves: every seed of an arm (chapters 3 to 5), and the arms of one knob (2 and 5).
(() => {
  const { el, svg, brief, grouped, slider, rove, chart, path, band } = play;
  const MARKS = { line: ["", "5 3", "2 3", "8 3 2 3", "12 4"], colour: ["var(--blue)", "var(--vermillion)", "var(--purple)", "var(--orange)", "var(--green)"] };
  const exact = (y) => String(y).replace("-", "−");
  const finite = (ys) => ys.filter((y) => y != null);
  const range = (ys, log) => {
    const [low, high] = [Math.min(...ys), Math.max(...ys)];
    if (log) return { low: low / 1.1, high: high * 1.1 };
    const room = 0.05 * (high - low || Math.abs(high) || 1);
    return { low: low >= 0 && low < 0.4 * high ? 0 : low - room, high: high + room };
  };

  play.widgets.seeds = (live, data, host) => {
    // Learned first, and the failures in the order in which their words come up.
    const fates = [...new Set(data.seeds.map((it) => it.fate))].sort((a, b) =>
      data.seeds.find((it) => it.fate === a).failed - data.seeds.find((it) => it.fate === b).failed);
    const look = (it) => fates.indexOf(it.fate) % MARKS.colour.length;
    const films = [...(host.nextElementSibling?.querySelectorAll(".play-film") ?? [])];
    let picked = 0;
    let failedOnly = false;
    const shown = () => data.seeds.map((_, i) => i).filter((i) => !failedOnly || data.seeds[i].failed);

    const all = data.seeds.flatMap((it) => finite(it.steps)).concat(data.original ? finite([...data.original.low, ...data.original.high]) : []);
    const plot = chart("A line for each seed.", 340,
      { label: "episode", low: Math.min(0, data.episode[0]), high: data.episode.at(-1) },
      { label: data.y_label, log: data.log, ...range(all, data.log) }, paint);
    const said = el("p", { class: "play-said", "aria-live": "polite" });
    const csv = el("a", { class: "play-link", download: "seed.csv" });
    const film = el("button", { type: "button", onclick: () => {
      const it = films[filmOf(picked)];
      it.open = true;
      it.scrollIntoView({ block: "nearest" });
      it.querySelector("video")?.focus();
    } });
    const filmOf = (i) => data.films.findIndex((it) => it.seed === data.seeds[i].seed);
    const count = data.seeds.filter((it) => it.failed).length;
    const toggle = el("button", { type: "button", "aria-pressed": "false", onclick: () => {
      failedOnly = !failedOnly;
      if (!shown().includes(picked)) picked = shown()[0];
      render();
    } }, `failed seeds only (${count})`);
    toggle.disabled = count === 0;
    const chips = data.seeds.map((it, i) =>
      el("button", { type: "button", class: "seed", style: `--colour: ${MARKS.colour[look(it)]}`, "aria-label": `seed ${it.seed}, ${it.fate}`,
        onclick: () => pick(i), onfocus: () => pick(i) }, String(it.seed), it.failed ? el("span", { "aria-hidden": "true" }, "✕") : ""));
    rove(chips, (i, key) => {
      const there = shown();
      const at = there.indexOf(i) + ({ ArrowRight: 1, ArrowDown: 1, ArrowLeft: -1, ArrowUp: -1 }[key] ?? Number.NaN);
      if (key === "Home") return there[0];
      if (key === "End") return there.at(-1);
      return Number.isNaN(at) ? null : there[at];
    });

    function nearest(event) {
      const frame = plot.host.getBoundingClientRect();
      const [px, py] = [event.clientX - frame.left, event.clientY - frame.top];
      let [found, closest] = [null, 24]; // pixels
      for (const i of shown()) data.seeds[i].steps.forEach((y, j) => {
        if (y == null) return;
        const distance = Math.hypot(plot.X(data.episode[j]) - px, plot.Y(y) - py);
        if (distance < closest) [found, closest] = [i, distance];
      });
      if (found != null && found !== picked) pick(found);
    }
    plot.host.addEventListener("pointermove", nearest);
    plot.host.addEventListener("pointerdown", nearest);

    const cross = (x, y) => svg("path", { class: "cut", d: `M${x - 4} ${y - 4}l8 8m0 -8l-8 8` });
    function paint(layer, X, Y) {
      if (data.original) layer.append(svg("path", { class: "original", d: band(data.original.episode, data.original.low, data.original.high, X, Y) }));
      const line = (it, kind) => svg("path", { class: kind, d: path(data.episode, it.steps, X, Y), "stroke-dasharray": MARKS.line[look(it)], style: `stroke: ${MARKS.colour[look(it)]}` });
      for (const i of shown()) {
        const it = data.seeds[i];
        layer.append(line(it, "seed-line"));
        for (const j of it.cut) layer.append(cross(X(data.episode[j]), Y(it.steps[j])));
        const end = it.steps.findLastIndex((y) => y != null);
        if (end >= 0 && end < data.episode.length - 1)
          layer.append(cross(X(data.episode[end]), Y(it.steps[end])));
      }
      if (!failedOnly) {
        const { low, median, high } = data.middle;
        layer.append(svg("path", { class: "band", d: band(data.episode, low, high, X, Y) }), svg("path", { class: "median", d: path(data.episode, median, X, Y) }));
      }
      layer.append(svg("path", { class: "halo", d: path(data.episode, data.seeds[picked].steps, X, Y) }), line(data.seeds[picked], "picked-line"));
    }
    function pick(i) {
      picked = i;
      render();
    }
    function render() {
      const it = data.seeds[picked];
      toggle.setAttribute("aria-pressed", failedOnly);
      const there = shown();
      chips.forEach((chip, i) => {
        chip.hidden = !there.includes(i);
        chip.setAttribute("aria-pressed", i === picked);
        chip.tabIndex = i === picked ? 0 : -1;
      });
      said.textContent = `Seed ${it.seed}: ${it.fate}. ${it.steps_at_end == null ? "Stopped before the end" : `${brief(it.steps_at_end)} steps at the end`}; ${grouped(it.env_steps)} environment steps used.`;
      const rows = data.episode.map((episode, j) => `${it.seed},${episode},${it.steps[j] ?? ""}`);
      csv.href = `data:text/csv;charset=utf-8,${encodeURIComponent(["seed,episode,steps", ...rows, ""].join("\n"))}`;
      csv.download = `seed_${it.seed}.csv`;
      csv.textContent = `rows of seed ${it.seed} (CSV${rows.length < data.rows_in_all ? `, ${rows.length} of ${grouped(data.rows_in_all)} episodes` : ""})`;
      film.hidden = filmOf(picked) < 0;
      film.textContent = film.hidden ? "" : `film: ${data.films[filmOf(picked)].name}`;
      plot.draw();
    }
    const key = fates.map((fate, i) => {
      const line = svg("line", { x1: 0, x2: 28, y1: 6, y2: 6, "stroke-width": 2.5, "stroke-dasharray": MARKS.line[i % MARKS.line.length], style: `stroke: ${MARKS.colour[i % MARKS.colour.length]}` });
      const sample = svg("svg", { width: 28, height: 12, "aria-hidden": "true" }, line);
      return el("span", { class: "key drawn" }, sample, `${fate} (${data.seeds.filter((it) => it.fate === fate).length})`);
    });
    key.push(el("span", { class: "key line strong", style: "--colour: var(--ink)" }, data.middle_name));
    if (data.original) key.push(el("span", { class: "key original" }, "2018 original, one run"));
    if (data.seeds.some((it) => it.cut.length || it.steps.at(-1) == null)) key.push(el("span", {}, "✕ stopped"));
    if (data.title) live.append(el("p", { class: "play-said title" }, data.title));
    live.append(
      el("div", { class: "play-row" }, toggle, el("span", { class: "play-key" }, "point at a line, or choose a seed (best first; arrow keys)")),
      el("div", { class: "play-seeds", role: "group", "aria-label": "Seeds, best first" }, chips),
      plot.host, el("p", { class: "play-key" }, key),
      said, el("div", { class: "play-row" }, csv, film));
    render();
  };

  play.widgets.knob = (live, data) => {
    let at = Math.floor((data.values.length - 1) / 2);
    const bands = data.curves.flatMap((it) => finite([...it.median, ...(it.low ?? []), ...(it.high ?? [])]));
    const episodes = data.curves.flatMap((it) => it.episode);
    const plot = chart(`Curves for ${data.name}`, 300,
      { label: "episode", low: Math.min(0, ...episodes), high: Math.max(...episodes) },
      { label: data.y_label, log: data.log, ...range(data.log ? bands.filter((y) => y > 0) : bands, data.log) },
      (layer, X, Y) => {
        data.curves.forEach((it) => layer.append(svg("path", { class: "other-line", d: path(it.episode, it.median, X, Y) })));
        const it = data.curves[at];
        if (it.low) layer.append(svg("path", { class: "band", d: band(it.episode, it.low, it.high, X, Y) }));
        layer.append(svg("path", { class: "knob-line", d: path(it.episode, it.median, X, Y) }));
      });
    // Knobs are turned by factors more often than by steps.
    const ratio = data.values[0] > 0 && data.values.at(-1) / data.values[0] > 8;
    const x = { label: `${data.name}${ratio ? " (logarithmic)" : ""}`, log: ratio, low: data.values[0] / (ratio ? 1.2 : 1), high: data.values.at(-1) * (ratio ? 1.2 : 1) };
    if (!ratio) {
      const room = 0.05 * (x.high - x.low || 1);
      Object.assign(x, { low: x.low - room, high: x.high + room });
    }
    const measures = data.measures.map((measure) => {
      const value = el("strong", {});
      const small = chart(`${measure.name} against ${data.name}`, 170, { ...x, ticks: data.values }, { label: "", ...range(finite([measure.values, measure.low ?? [], measure.high ?? [], ...(measure.seeds ?? [])].flat()), false) },
        (layer, X, Y, box) => {
          if (measure.low) layer.append(svg("path", { class: "band", d: band(data.values, measure.low, measure.high, X, Y) }));
          (measure.seeds ?? []).forEach((each, i) => finite(each).forEach((y) => layer.append(svg("circle", { class: "one-seed", cx: X(data.values[i]), cy: Y(y), r: 2 }))));
          layer.append(
            svg("line", { class: "cursor", x1: X(data.values[at]), x2: X(data.values[at]), y1: box.top, y2: box.bottom }),
            svg("path", { class: "curve", d: path(data.values, measure.values, X, Y) }));
          measure.values.forEach((y, i) => y != null && layer.append(svg("circle", { class: i === at ? "cursor" : "dot", cx: X(data.values[i]), cy: Y(y), r: i === at ? 6 : 3.5 })));
        });
      return { element: el("div", {}, el("p", { class: "play-said" }, `${measure.name}: `, value), small.host), show: () => {
        value.textContent = measure.values[at] == null ? "–" : exact(measure.values[at]);
        small.draw();
      } };
    });
    const said = el("p", { class: "play-hidden", "aria-live": "polite" });
    const bar = slider(data.name, data.values.length - 1, (i) => `${data.name} = ${data.values[i]}`, (i) => { at = i; render(); });
    function render() {
      bar.set(at);
      plot.draw();
      measures.forEach((it) => it.show());
      said.textContent = data.measures.map((it) => `${it.name}: ${it.values[at] ?? "–"}`).join("; ");
    }
    live.append(bar.element, plot.host,
      el("p", { class: "play-key" }, el("span", { class: "key line strong", style: "--colour: var(--blue)" }, `chosen ${data.name}`), el("span", { class: "key line", style: "--colour: var(--quiet)" }, "the others")),
      el("div", { class: "play-measures" }, measures.map((it) => it.element)), said);
    render();
  };
})();
