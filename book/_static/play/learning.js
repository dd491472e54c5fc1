// Chapter 2: Q-learning, one step at a time. The moves of a real run are in the page; every table is
// computed from them, with the additions in the order of rl_core.q_learning: the same bits.
(() => {
  const { el, svg, fixed, grouped, slider, chart, path } = play;
  const { ACTIONS, SIGNS, CLOCKWISE, held } = play.maze;

  play.widgets.learning = (live, data) => {
    const w = play.maze.world(data.world);
    const n = w.terminal.length;
    const best = play.doubles(data.Q_star);
    const logged = data.lengths.length;
    const ends = [0];
    for (const length of data.lengths) ends.push(ends.at(-1) + length);
    const moves = new Uint8Array(2 * data.moves.length);
    [...data.moves].forEach((letter, i) => {
      const pair = data.digits.indexOf(letter);
      moves[2 * i] = pair >> 3;
      moves[2 * i + 1] = pair & 7;
    });
    const start = w.state(w.cells.findIndex((it) => it.join() === w.start.join()), 0);
    const snapshots = data.snapshots.map((it) => ({ episode: it.episode, Q: play.doubles(it.Q) }));
    const acting = [...Array(n).keys()].filter((s) => !w.terminal[s]);
    const unreachable = acting.filter((s) => !w.reachable[s]);
    const maximum = (Q, s) => Math.max(...Q.subarray(4 * s, 4 * s + 4));
    const greedy = (Q, s) => [0, 1, 2, 3].filter((a) => Q[4 * s + a] === maximum(Q, s));

    // The table after t steps, and the last of these steps.
    const run = { t: 0, s: start, episode: 0, Q: new Float64Array(4 * n), last: null };
    function advance(t) {
      if (t < run.t) Object.assign(run, { t: 0, s: start, episode: 0, Q: new Float64Array(4 * n), last: null });
      while (run.t < t) {
        const [a, k] = [moves[run.t] >> 1, moves[run.t] & 1];
        const { s, Q } = run;
        const [next, r] = w.outcome(s, a, k);
        const end = w.terminal[next];
        const from = Q[4 * s + a];
        const free = greedy(Q, s).includes(a);
        const ahead = end ? 0 : maximum(Q, next);
        const target = end ? r : r + data.gamma * ahead;
        Q[4 * s + a] += data.step_size * (target - from);
        run.last = { s, a, k, next, r, end, from, ahead, to: Q[4 * s + a], free, episode: run.episode + 1, step: run.t - ends[run.episode] + 1 };
        run.t += 1;
        if (run.t === ends[run.episode + 1]) run.episode += 1;
        run.s = run.last.end ? start : next;
      }
    }
    // Where the reader is: after step t, or at a snapshot.
    let [t, snapshot, cell, set] = [0, null, null, null];
    const stops = logged + snapshots.length;
    const Q = () => (snapshot ? snapshot.Q : run.Q);

    const bar = slider("episode", stops, (i) => {
      const episode = i <= logged ? i : snapshots[i - logged - 1].episode;
      return `after episode ${grouped(episode)}`;
    }, (i) => {
      snapshot = i <= logged ? null : snapshots[i - logged - 1];
      go(i <= logged ? ends[i] : t, true);
    });
    const button = (name, act) => el("button", { type: "button", onclick: act }, name);
    const finished = () => (snapshot ? logged : run.episode);
    const toReward = () => {
      do advance(run.t + 1); while (run.t < ends[logged] && !run.last.r);
      return run.t;
    };
    const buttons = {
      back: button("◀ step", () => go(t - 1)),
      on: button("step ▶", () => go(t + 1)),
      ten: button("10 steps ▶", () => go(t + 10)),
      episode: button("end of episode", () => go(ends[finished() + 1])),
      reward: button("next reward", () => go(toReward())),
    };
    const plan = play.maze.grid(w, (i) => { cell = i; render(); });
    const where = el("strong", {});
    const title = el("p", { class: "play-said", "aria-live": "polite" });
    const formula = el("p", { class: "play-update" });
    const row = el("tbody", {});
    const rowTitle = el("p", { class: "play-said" });
    const table = el("table", { class: "play-backup plain" },
      el("thead", {}, el("tr", {}, ["action", "Q(s, a)", "Q*(s, a)", "error"].map((it) => el("th", { scope: "col" }, it)))), row);
    const error = el("p", { class: "play-said" });
    const curve = chart("Error of the table against the episode, with a cursor.", 230,
      { label: "episode (logarithmic)", low: 1, high: data.curve.episode.at(-1), log: true },
      { label: "‖Q − Q*‖", low: 0, high: data.curve.error[0] * 1.05 }, paint);

    const minis = w.sets.map((flags, i) => {
      const squares = w.cells.map(([r, c]) => svg("rect", { x: c, y: r, width: 0.94, height: 0.94 }));
      const hatches = w.cells.map(([r, c], cellNumber) => {
        const s = w.state(cellNumber, i);
        return !w.terminal[s] && !w.reachable[s] ? svg("path", { d: `M${c + 0.1} ${r + 0.84}L${c + 0.84} ${r + 0.1}M${c + 0.1} ${r + 0.1}L${c + 0.84} ${r + 0.84}` }) : "";
      });
      const picture = svg("svg", { viewBox: `0 0 ${w.columns} ${w.rows}`, "aria-hidden": "true" }, squares, hatches);
      const element = el("button", { type: "button", class: "mini", onclick: () => { set = i; render(); } }, picture, flags || "none");
      return { element, squares };
    });

    const norm = (states) => Math.sqrt(states.reduce((sum, s) => {
      for (let a = 0; a < 4; a += 1) sum += (Q()[4 * s + a] - best[4 * s + a]) ** 2;
      return sum;
    }, 0));
    const reachable = acting.filter((s) => w.reachable[s]);

    function paint(layer, X, Y, box) {
      const plateau = norm(unreachable);
      const done = snapshot ? snapshot.episode : run.episode + (run.last && run.t < ends[run.episode + 1] ? (run.t - ends[run.episode]) / data.lengths[run.episode] : 0);
      const [x, y] = [X(Math.max(1, done)), Y(norm(acting))];
      layer.append(
        svg("line", { class: "plateau", x1: box.left, x2: box.right, y1: Y(plateau), y2: Y(plateau) }),
        svg("text", { x: box.left + 6, y: Y(plateau) + 16 }, `${unreachable.length} states that cannot be reached: ${fixed(plateau, 3)}`),
        svg("path", { class: "curve", d: path(data.curve.episode.slice(1), data.curve.error.slice(1), X, Y) }),
        svg("line", { class: "cursor", x1: x, x2: x, y1: box.top, y2: box.bottom }),
        svg("circle", { class: "cursor", cx: x, cy: y, r: 5 }));
    }

    function explain() {
      const last = snapshot ? null : run.last;
      formula.hidden = !last;
      if (snapshot) {
        title.textContent = `Snapshot after episode ${grouped(snapshot.episode)}. Single steps are logged up to episode ${grouped(logged)}.`;
        return;
      }
      if (!last) {
        title.textContent = `Before the first step: Q is zero everywhere, and the agent is at S. In ${logged} episodes it will take ${grouped(ends[logged])} steps.`;
        return;
      }
      const { s, a, k, next, r, end } = last;
      const flags = w.taken(s, next);
      const landed = next === s ? "stays" : `gets to ${w.place(next)}${flags ? ` and takes flag ${flags}` : ""}${end ? ", the goal" : ""}`;
      title.textContent = `Episode ${last.episode}, step ${last.step} of ${data.lengths[last.episode - 1]}: at ${w.place(s)}, ${held(w.sets[w.set(s)])}, the agent chooses ${ACTIONS[a]} (${last.free ? "a greedy action" : "not the greedy action"}), ${k ? `slips ${ACTIONS[CLOCKWISE[a]]} and ` : ""}${landed}.`;
      const sum = end ? `${r}` : `${r} + ${data.gamma} × ${fixed(last.ahead, 4)}`;
      const symbols = end ? "r" : "r + γ max Q(s′, ·)";
      formula.replaceChildren(
        el("span", {}, `Q(s, ${ACTIONS[a]}) ← Q + α [${symbols} − Q]`),
        el("span", {}, `= ${fixed(last.from, 4)} + ${data.step_size} × [${sum} − ${fixed(last.from, 4)}]`),
        el("strong", {}, `= ${fixed(last.to, 4)}`));
    }
    function render() {
      const now = Q();
      const here = snapshot ? start : run.t ? run.last.next : start;
      const of = snapshot ? start : run.last ? run.last.s : start;
      const shown = set ?? w.set(of);
      const picked = w.state(cell ?? w.cell(of), shown);
      const i = snapshot ? logged + 1 + snapshots.indexOf(snapshot) : run.episode;
      bar.set(i);
      if (!snapshot && run.t !== ends[run.episode]) bar.element.querySelector("output").textContent = `in episode ${run.episode + 1}`;
      buttons.back.disabled = Boolean(snapshot) || run.t === 0;
      for (const name of ["on", "ten", "episode", "reward"]) buttons[name].disabled = Boolean(snapshot) || run.t >= ends[logged];
      where.textContent = `Situation ${shown + 1}: ${held(w.sets[shown])}`;
      plan.show(shown, (s) => ({
        value: maximum(now, s),
        chosen: greedy(now, s),
        agent: !snapshot && w.cell(s) === w.cell(here) && (w.set(here) === shown || w.set(of) === shown),
        marks: [...(s === picked ? ["picked"] : []), ...(!snapshot && run.last && s === run.last.s ? ["moved"] : [])],
      }));
      rowTitle.textContent = `The row of ${w.place(picked)}, ${held(w.sets[shown])}${w.reachable[picked] ? "" : ": cannot be reached, so nothing is ever learned here"}:`;
      row.replaceChildren(...ACTIONS.map((name, a) => {
        const [q, star] = [now[4 * picked + a], best[4 * picked + a]];
        const updated = !snapshot && run.last && run.last.s === picked && run.last.a === a;
        return el("tr", { class: updated ? "best" : "" }, el("th", { scope: "row" }, `${SIGNS[a]} ${name}`),
          [q, star, q - star].map((x, j) => el("td", { class: j ? "" : "result left" }, fixed(x, 4))));
      }));
      const [all, stuck, rest] = [acting, unreachable, reachable].map(norm);
      error.textContent = `‖Q − Q*‖ = ${fixed(all, 4)} = √(${fixed(stuck, 4)}² + ${fixed(rest, 4)}²): the ${unreachable.length} states that cannot be reached, and all others.`;
      minis.forEach(({ element, squares }, situation) => {
        element.setAttribute("aria-pressed", situation === shown);
        let sum = 0;
        squares.forEach((square, c) => {
          const s = w.state(c, situation);
          const size = norm([s]);
          sum += size ** 2;
          const share = Math.min(1, size / (1.6 * w.top));
          square.setAttribute("fill", `color-mix(in srgb, #d55e00 ${Math.round(100 * share)}%, #f4f1e8)`);
        });
        element.setAttribute("aria-label", `Situation ${situation + 1}, ${held(w.sets[situation])}: error ${fixed(Math.sqrt(sum), 3)}`);
      });
      curve.draw();
      explain();
    }
    function go(to, quiet) {
      if (!quiet) snapshot = null;
      t = Math.min(ends[logged], Math.max(0, to));
      advance(t);
      [cell, set] = [null, null]; // follow the agent
      render();
    }
    live.append(
      bar.element,
      el("div", { class: "play-choice" }, Object.values(buttons)),
      el("div", { class: "play-two" },
        el("div", {}, where, plan.element,
          el("p", { class: "play-key" }, el("span", { class: "key agent" }, "agent"), el("span", { class: "key moved" }, "value updated"), el("span", { class: "key unreachable" }, "cannot be reached"))),
        el("div", {}, title, formula, rowTitle, table)),
      el("div", {}, error, curve.host),
      el("div", {}, el("p", { class: "play-key" }, "Where the error is, by flags held (the darker the more; ✕ cannot be reached):"),
        el("div", { class: "play-minis", role: "group", "aria-label": "Situations" }, minis.map((it) => it.element))));
    render();
  };
})();
