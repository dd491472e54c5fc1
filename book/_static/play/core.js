// What the figures that answer have in common. Classic scripts and inline data: a page that was
// opened from a file works as well. Each script registers under play.widgets how to build the
// figures of one kind; they are built when the page is there, and until then, in print and without
// scripts, the still picture stands in their place.
window.play = (() => {
  const widgets = {};
  const SVG = "http://www.w3.org/2000/svg";

  const fill = (element, attributes, children) => {
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
      else if (value === true) element.setAttribute(name, "");
      else if (value !== false && value != null) element.setAttribute(name, value);
    }
    element.append(...children.flat());
    return element;
  };
  const el = (tag, attributes = {}, ...children) =>
    fill(document.createElement(tag), attributes, children);
  const svg = (tag, attributes = {}, ...children) =>
    fill(document.createElementNS(SVG, tag), attributes, children);

  // Numbers as Python prints them with a fixed number of decimals, but for the minus sign.
  const fixed = (x, decimals) =>
    x == null || Number.isNaN(x) ? "–" : x.toFixed(decimals).replace(/^-(?=0\.?0*$)/, "").replace("-", "−");
  const grouped = (x) => (x == null || Number.isNaN(x) ? "–" : String(x).replace(/\B(?=(\d{3})+(?!\d))/g, ","));

  const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
  const doubles = (text) => new Float64Array(bytes(text));
  const floats = (text) => new Float32Array(bytes(text));

  // A row of buttons of which one is pressed; the arrow keys walk along it and press.
  function choice(label, names, pick) {
    const buttons = names.map((name, i) =>
      el("button", { type: "button", "aria-pressed": "false", onclick: () => pick(i) }, name));
    const group = el("div", { class: "play-choice", role: "group", "aria-label": label }, buttons);
    return { element: group, buttons, set: (i) => buttons.forEach((b, j) => b.setAttribute("aria-pressed", i === j)) };
  }

  // A slider with a button on either side, and its value in words.
  function slider(label, last, words, change) {
    const input = el("input", { type: "range", min: 0, max: last, step: 1, value: 0, "aria-label": label });
    const shown = el("output", {});
    const step = (by, sign, name) =>
      el("button", { type: "button", "aria-label": name, onclick: () => go(Number(input.value) + by) }, sign);
    const [back, on] = [step(-1, "◀", `${label}: one back`), step(1, "▶", `${label}: one on`)];
    function set(i) {
      input.value = i;
      shown.textContent = words(i);
      input.setAttribute("aria-valuetext", words(i));
      back.disabled = i <= 0;
      on.disabled = i >= last;
    }
    function go(i) {
      const value = Math.min(last, Math.max(0, i));
      set(value);
      change(value);
    }
    input.addEventListener("input", () => go(Number(input.value)));
    return { element: el("div", { class: "play-slider" }, back, input, on, shown), set, input };
  }

  // Among items of which one can be reached by Tab, the arrow keys move the focus.
  function rove(items, next) {
    items.forEach((item, i) => {
      item.tabIndex = i ? -1 : 0;
      item.addEventListener("focus", () => items.forEach((other) => (other.tabIndex = other === item ? 0 : -1)));
      item.addEventListener("keydown", (event) => {
        const target = next(i, event.key);
        if (target == null || !items[target]) return;
        event.preventDefault();
        items[target].focus();
      });
    });
  }

  const ticks = (low, high, count) => {
    const raw = (high - low) / count;
    const power = 10 ** Math.floor(Math.log10(raw));
    const step = [1, 2, 5, 10].map((x) => x * power).find((x) => x >= raw);
    const found = [];
    for (let i = Math.ceil(low / step - 1e-9); i * step <= high + 1e-9 * step; i += 1) found.push(i * step);
    return found;
  };
  const decades = (low, high) => {
    const found = [];
    for (let e = Math.floor(Math.log10(low)); 10 ** e <= high; e += 1)
      for (const m of high / low > 50 ? [1] : [1, 2, 5]) if (m * 10 ** e >= low && m * 10 ** e <= high) found.push(m * 10 ** e);
    return found;
  };
  const brief = (x) => {
    if (Math.abs(x) >= 1000) return grouped(Math.round(x));
    return String(Number(x.toPrecision(3))).replace("-", "−");
  };

  // A chart that is drawn anew at its own width, so that its type keeps its size on a phone.
  // axis: {label, low, high, log}; paint(layer, X, Y, box) draws what changes.
  function chart(label, height, x, y, paint) {
    const host = el("div", { class: "play-chart" });
    const scale = (axis, from, to) => {
      const f = axis.log ? Math.log10 : Number;
      const [low, high] = [f(axis.low), f(axis.high)];
      return (value) => from + ((f(value) - low) / (high - low)) * (to - from);
    };
    const state = { host, X: Number, Y: Number, draw };
    function draw() {
      const width = host.clientWidth;
      if (!width) return;
      const box = { left: 52, right: width - 10, top: 22, bottom: height - 38 };
      const X = (state.X = scale(x, box.left, box.right));
      const Y = (state.Y = scale(y, box.bottom, box.top));
      const picture = svg("svg", { width, height, role: "img", "aria-label": label });
      const xs = x.ticks ?? (x.log ? decades(x.low, x.high) : ticks(x.low, x.high, Math.max(2, width / 110)));
      const ys = y.log ? decades(y.low, y.high) : ticks(y.low, y.high, Math.max(2, height / 60));
      let end = -Infinity;
      for (const value of xs) {
        picture.append(svg("line", { class: "grid", x1: X(value), x2: X(value), y1: box.top, y2: box.bottom }));
        if (X(value) - end < 34) continue;
        end = X(value);
        picture.append(svg("text", { x: Math.min(end, width - 16), y: box.bottom + 16, "text-anchor": "middle" }, brief(value)));
      }
      for (const value of ys) {
        picture.append(
          svg("line", { class: "grid", x1: box.left, x2: box.right, y1: Y(value), y2: Y(value) }),
          svg("text", { x: box.left - 6, y: Y(value) + 4, "text-anchor": "end" }, brief(value)));
      }
      picture.append(
        svg("text", { x: (box.left + box.right) / 2, y: height - 6, "text-anchor": "middle" }, x.label),
        svg("text", { x: 2, y: 12 }, y.label));
      const layer = svg("g", {});
      picture.append(layer);
      paint(layer, X, Y, box);
      host.replaceChildren(picture);
    }
    new ResizeObserver(draw).observe(host);
    return state;
  }

  // A line through the points that are there; it has gaps where they are not.
  function path(xs, ys, X, Y) {
    let pen = "M";
    let d = "";
    xs.forEach((x, i) => {
      if (ys[i] == null || Number.isNaN(ys[i])) return (pen = "M");
      d += `${pen}${X(x).toFixed(1)} ${Y(ys[i]).toFixed(1)}`;
      return (pen = "L");
    });
    return d;
  }
  function band(xs, low, high, X, Y) {
    const there = xs.map((_, i) => i).filter((i) => low[i] != null && high[i] != null);
    const side = (order, ys) => order.map((i) => `${X(xs[i]).toFixed(1)} ${Y(ys[i]).toFixed(1)}`);
    const points = [...side(there, high), ...side(there.reverse(), low)];
    return points.length ? `M${points.join("L")}Z` : "";
  }

  const hosts = () => document.querySelectorAll("[data-play]:not(.play-on)");
  function build(some = hosts()) {
    for (const host of some) {
      const kind = widgets[host.dataset.play];
      if (!kind) continue;
      const live = el("div", { class: "play-live" });
      host.append(live);
      kind(live, JSON.parse(host.querySelector(":scope > script").textContent), host);
      host.classList.add("play-on");
    }
  }
  document.addEventListener("DOMContentLoaded", () => build()); // in the book `late.js` does it

  return { hosts, build, widgets, el, svg, fixed, grouped, brief, doubles, floats, choice, slider, rove, chart, path, band };
})();
