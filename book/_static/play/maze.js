// The Maze as a grid of buttons, and chapter 1: planning, one sweep at a time.
(() => {
  const { el, svg, fixed, choice, slider, rove } = play;
  const ACTIONS = ["up", "down", "left", "right"];
  const SIGNS = ["↑", "↓", "←", "→"];
  const MOVES = [[-1, 0], [1, 0], [0, -1], [0, 1]];
  const CLOCKWISE = [3, 2, 0, 1];
  const WORDS = { moved: "value changed", turned: "arrow changed" };
  // The light part of the scale that the still figures use, yellow to blue.
  const SCALE = [[255, 255, 217], [237, 248, 177], [199, 233, 180], [127, 205, 187], [65, 182, 196]];

  const shade = (share) => {
    const at = Math.min(0.9999, Math.max(0, share)) * (SCALE.length - 1);
    const i = Math.floor(at);
    return `rgb(${SCALE[i].map((from, c) => Math.round(from + (at - i) * (SCALE[i + 1][c] - from)))})`;
  };
  const held = (flags) => {
    if (!flags) return "no flag held";
    if (flags.length === 1) return `flag ${flags} held`;
    return `flags ${[...flags.slice(0, -1)].join(", ")} and ${flags.at(-1)} held`;
  };

  // Arrows from the middle of a cell, one for each action chosen.
  const arrows = (chosen) => {
    const picture = svg("svg", { class: "arrows", viewBox: "-12 -12 24 24", "aria-hidden": "true" });
    for (const a of chosen) {
      const angle = [270, 90, 180, 0][a];
      const [from, to] = chosen.length > 1 ? [2, 10] : [-8, 9];
      const head = chosen.length > 2 ? "l-2 -1.6v3.2z" : "l-5 -3.6v7.2z";
      picture.append(svg("path", { d: `M${from} 0H${to - 2}M${to} 0${head}`, transform: `rotate(${angle})` }));
    }
    return picture;
  };

  // What a world is: its cells, flags and successors as rl_core.maze numbers them.
  function world(data) {
    const sets = data.flag_sets;
    return {
      ...data,
      sets,
      state: (cell, set) => cell * sets.length + set,
      cell: (s) => Math.floor(s / sets.length),
      set: (s) => s % sets.length,
      place: (s) => `(${data.cells[Math.floor(s / sets.length)].join(", ")})`,
      taken: (s, next) => [...sets[next % sets.length]].filter((flag) => !sets[s % sets.length].includes(flag)).join(""),
      outcome: (s, a, k) => [data.successor[(s * 4 + a) * 2 + k], data.reward[(s * 4 + a) * 2 + k]],
    };
  }

  // Values of one situation on the floor plan; pick(cell) is called by click, Enter and Space.
  function grid(w, pick) {
    const buttons = w.cells.map((_, cell) => el("button", { type: "button", class: "cell", onclick: () => pick(cell) }));
    const number = new Map(w.cells.map(([row, column], cell) => [`${row},${column}`, cell]));
    const items = [];
    for (let row = 0; row < w.rows; row += 1)
      for (let column = 0; column < w.columns; column += 1)
        items.push(buttons[number.get(`${row},${column}`)] ?? el("div", { class: "wall" }));
    rove(buttons, (cell, key) => {
      const move = MOVES[["ArrowUp", "ArrowDown", "ArrowLeft", "ArrowRight"].indexOf(key)];
      if (!move) return null;
      let [row, column] = w.cells[cell];
      for (;;) { // over walls
        [row, column] = [row + move[0], column + move[1]];
        if (row < 0 || column < 0 || row >= w.rows || column >= w.columns) return cell;
        if (number.has(`${row},${column}`)) return number.get(`${row},${column}`);
      }
    });
    const element = el("div", { class: "play-maze", role: "group", "aria-label": "The Maze", style: `--columns: ${w.columns}` }, items);
    // show(set, look): look(s) tells value, chosen actions, and marks (classes) of a state
    function show(set, look) {
      const flags = w.sets[set];
      buttons.forEach((button, cell) => {
        const s = w.state(cell, set);
        const [row, column] = w.cells[cell];
        const here = (it) => it[0] === row && it[1] === column;
        const flag = Object.keys(w.flags).find((letter) => here(w.flags[letter]));
        const { value, chosen, marks, agent } = look(s);
        const parts = [];
        if (here(w.start)) parts.push(el("span", { class: "letter" }, "S"));
        if (flag) parts.push(el("span", { class: flags.includes(flag) ? "flag taken" : "flag" }, flag));
        if (w.terminal[s]) parts.push(el("span", { class: "goal" }, "G"), el("span", { class: "value" }, `pays ${flags.length}`));
        else parts.push(arrows(chosen), el("span", { class: "value" }, fixed(value, 3)));
        if (agent) parts.push(el("span", { class: "agent", title: "the agent" }));
        button.className = ["cell", ...marks, ...(w.reachable[s] ? [] : ["unreachable"])].join(" ");
        button.style.backgroundColor = w.terminal[s] ? "" : shade(value / w.top);
        const words = w.terminal[s]
          ? "goal"
          : `value ${fixed(value, 3)}, ${chosen.length === 4 ? "any action" : chosen.map((a) => ACTIONS[a]).join(" or ")}`;
        const more = [flag && `flag ${flag}`, !w.reachable[s] && "cannot be reached", agent && "the agent", ...marks.map((it) => WORDS[it])].filter(Boolean);
        button.setAttribute("aria-pressed", marks.includes("picked"));
        button.setAttribute("aria-label", [`row ${row}, column ${column}`, words, ...more].join(", "));
        button.replaceChildren(...parts);
      });
    }
    return { element, buttons, show };
  }

  // One button a flag: which ones are held, of the 2^n situations.
  function situations(w, change) {
    const letters = Object.keys(w.flags);
    let set = 0;
    const title = el("strong", {});
    const buttons = letters.map((letter) =>
      el("button", { type: "button", onclick: () => {
        const flags = letters.filter((it) => w.sets[set].includes(it) !== (it === letter)).join("");
        change(w.sets.indexOf(flags));
      } }, `flag ${letter}`));
    const element = el("div", { class: "play-row" }, el("span", { class: "play-choice", role: "group", "aria-label": "Flags held" }, buttons), title);
    return { element, set: (number) => {
      set = number;
      letters.forEach((letter, i) => buttons[i].setAttribute("aria-pressed", w.sets[set].includes(letter)));
      title.textContent = `Situation ${set + 1}: ${held(w.sets[set])}`;
    } };
  }

  play.maze = { ACTIONS, SIGNS, CLOCKWISE, world, grid, situations, held, shade };

  play.widgets.sweeps = (live, data) => {
    const w = world(data.world);
    const n = w.terminal.length;
    const methods = data.methods.map((method) => {
      const V = play.doubles(method.V);
      return { ...method, V: method.chosen.map((_, k) => V.subarray(k * n, (k + 1) * n)) };
    });
    let [now, at, set, cell] = [0, [0, 0], 0, w.cells.findIndex((it) => it.join() === w.start.join())];

    // Q(s, a) as the sum of its outcomes, in the order in which rl_core adds them.
    const backup = (V, s, a) => {
      let q = 0;
      for (const k of [0, 1]) {
        const [next, r] = w.outcome(s, a, k);
        q += w.probability[k] * (r + data.gamma * V[next]);
      }
      return q;
    };
    const chosen = (method, k, s) => {
      const mask = Number.parseInt(method.chosen[k][s], 16);
      return [0, 1, 2, 3].filter((a) => mask & (1 << a));
    };

    const tabs = choice("Method", methods.map((it) => it.name), (i) => { now = i; render(); });
    const choose = situations(w, (i) => { set = i; render(); });
    const plan = grid(w, (i) => { cell = i; render(); });
    const sliders = methods.map((method, i) =>
      slider(method.unit, method.V.length - 1, (k) => `${method.unit} ${k} of ${method.V.length - 1}`, (k) => { at[i] = k; render(); }));
    const changes = el("p", { class: "play-said", "aria-live": "polite" });
    const title = el("p", { class: "play-said title", "aria-live": "polite" });
    const lines = el("tbody", {});
    const head = el("tr", {});
    const formula = el("p", { class: "play-formula" });
    const table = el("table", { class: "play-backup" }, el("thead", {}, head), lines);

    function outcome(s, a, k, V, p) {
      const [next, r] = w.outcome(s, a, k);
      const flags = w.taken(s, next);
      const where = next === s ? "stays" : `to ${w.place(next)}${flags ? `, takes ${flags}` : ""}`;
      return el("td", {},
        el("span", { class: "sum" }, `${k ? "+ " : ""}${p} × [${r} + ${data.gamma} × ${fixed(V[next], 4)}]`),
        el("small", {}, k ? `slips ${ACTIONS[CLOCKWISE[a]]}: ${where}` : where));
    }
    function explain(method, k) {
      const s = w.state(cell, set);
      const where = `${w.place(s)}, ${held(w.sets[set])}`;
      const off = w.terminal[s] || k === 0;
      table.hidden = formula.hidden = off;
      if (off) {
        title.textContent = w.terminal[s]
          ? `${where}: the goal ends the episode. Its value is 0; what it pays belongs to the move that enters it.`
          : `${where}: before the first ${method.unit} every value is 0. Move the slider.`;
        return;
      }
      const policy = method.kind === "policy";
      const V = policy ? method.V[k] : method.V[k - 1];
      const Q = ACTIONS.map((_, a) => backup(V, s, a));
      const best = chosen(method, k, s);
      const old = policy ? chosen(method, k - 1, s)[0] : null;
      const source = policy ? "v of the policy of this round" : `V of sweep ${k - 1}`;
      formula.textContent = `Q(s, a) = Σ p [r + ${data.gamma} V(s′)], with V = ${source}; cells are (row, column).`;
      head.replaceChildren(...["action", `as meant, p = ${w.probability[0]}`, `slip, p = ${w.probability[1]}`, "Q"].map((it) => el("th", { scope: "col" }, it)));
      lines.replaceChildren(...ACTIONS.map((name, a) =>
        el("tr", { class: best.includes(a) ? "best" : "" },
          el("th", { scope: "row" }, `${SIGNS[a]} ${name}`, a === old ? el("small", {}, "the policy") : ""),
          outcome(s, a, 0, V, w.probability[0]), outcome(s, a, 1, V, w.probability[1]),
          el("td", { class: "result" }, `= ${fixed(Q[a], 4)}`))));
      const names = best.length === 4 ? "all actions" : best.map((a) => ACTIONS[a]).join(" or ");
      const max = fixed(Math.max(...Q), 4);
      title.textContent = policy
        ? `${where}: the policy of round ${k} goes ${ACTIONS[old]}, which is worth ${fixed(V[s], 4)}. The maximum is ${max}, ${names}: ${best[0] === old ? "it stays" : "it changes"}.`
        : `${where}, sweep ${k}: V = max Q = ${max}, by ${names}.`;
    }
    function render() {
      const method = methods[now];
      const k = at[now];
      const V = method.V[k];
      const before = method.V[Math.max(0, k - 1)];
      const acting = [...V.keys()].filter((s) => !w.terminal[s]);
      const moved = (s) => fixed(V[s], 3) !== fixed(before[s], 3);
      const turned = (s) => k > 0 && method.chosen[k][s] !== method.chosen[k - 1][s];
      tabs.set(now);
      choose.set(set);
      sliders.forEach((it, i) => { it.element.hidden = i !== now; it.set(at[i]); });
      plan.show(set, (s) => ({
        value: V[s],
        chosen: chosen(method, k, s),
        marks: [...(moved(s) ? ["moved"] : []), ...(turned(s) ? ["turned"] : []), ...(w.cell(s) === cell ? ["picked"] : [])],
      }));
      const largest = Math.max(...acting.map((s) => Math.abs(V[s] - before[s])));
      changes.textContent = k === 0
        ? `Before the first ${method.unit}: all values are 0.`
        : `${method.unit === "sweep" ? "Sweep" : "Round"} ${k} changed ${acting.filter(moved).length} of ${acting.length} values (in their three decimals, all situations), by up to ${fixed(largest, 4)}, and ${acting.filter(turned).length} arrows.`;
      explain(method, k);
    }
    live.append(
      el("div", { class: "play-row" }, tabs.element),
      ...sliders.map((it) => it.element), choose.element,
      el("div", { class: "play-two" },
        el("div", {}, plan.element,
          el("p", { class: "play-key" }, el("span", { class: "key moved" }, "value changed"), el("span", { class: "key turned" }, "arrow changed"), el("span", { class: "key unreachable" }, "cannot be reached"))),
        el("div", {}, changes, title, formula, table)));
    render();
  };
})();
