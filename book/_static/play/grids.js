// Snapshots of a field over a plane (chapter 5), with a slider over time and a cursor to read values.
(() => {
  const { el, svg, fixed, brief, slider, chart } = play;
  // Orange, white, purple: told apart with every common colour blindness, the middle is light.
  const ENDS = [[230, 97, 1], [247, 247, 247], [94, 60, 153]];
  const colour = (share) => {
    const t = Math.max(-1, Math.min(1, share));
    const end = ENDS[t < 0 ? 0 : 2];
    return ENDS[1].map((middle, c) => Math.round(middle + Math.abs(t) * (end[c] - middle)));
  };

  play.widgets.snapshots = (live, data) => {
    const grids = data.grids.map((it) => play.floats(it.values));
    const [rows, columns] = [data.y.length, data.x.length];
    let at = 0;
    let [row, column] = [rows >> 1, columns >> 1];
    // The field as a picture of one pixel a cell, which the chart stretches.
    const picture = (grid) => {
      const canvas = el("canvas", { width: columns, height: rows });
      const pen = canvas.getContext("2d");
      const image = pen.createImageData(columns, rows);
      for (let i = 0; i < rows; i += 1)
        for (let j = 0; j < columns; j += 1)
          image.data.set([...colour(grid[i * columns + j] / data.limit), 255], 4 * ((rows - 1 - i) * columns + j));
      pen.putImageData(image, 0, 0);
      return canvas.toDataURL();
    };
    const pictures = grids.map(picture);
    const half = (middles) => (middles.at(-1) - middles[0]) / (middles.length - 1) / 2;
    const axis = (middles, label) => ({ label, low: middles[0] - half(middles), high: middles.at(-1) + half(middles) });
    // Where the sign changes between two cells, their common side is drawn.
    const border = (grid, X, Y, dx, dy) => {
      let d = "";
      const sign = (i, j) => grid[i * columns + j] > 0;
      for (let i = 0; i < rows; i += 1)
        for (let j = 0; j < columns; j += 1) {
          const [right, upper] = [X(data.x[j]) + dx / 2, Y(data.y[i]) - dy / 2];
          if (j + 1 < columns && sign(i, j) !== sign(i, j + 1)) d += `M${right} ${upper}v${dy}`;
          if (i + 1 < rows && sign(i, j) !== sign(i + 1, j)) d += `M${right - dx} ${upper}h${dx}`;
        }
      return d;
    };
    const plot = chart(`${data.value_label} against ${data.x_label} and ${data.y_label}`, 330, axis(data.x, data.x_label), axis(data.y, data.y_label), (layer, X, Y, box) => {
      layer.append(svg("image", { href: pictures[at], x: box.left, y: box.top, width: box.right - box.left, height: box.bottom - box.top, preserveAspectRatio: "none", style: "image-rendering: pixelated" }));
      const [dx, dy] = [(box.right - box.left) / columns, (box.bottom - box.top) / rows];
      layer.append(svg("path", { class: "border", d: border(grids[at], X, Y, dx, dy) }));
      if (data.mark != null) layer.append(svg("line", { class: "mark", x1: X(data.mark), x2: X(data.mark), y1: box.top, y2: box.bottom }));
      const place = { x: X(data.x[column]) - dx / 2, y: Y(data.y[row]) - dy / 2, width: dx, height: dy };
      layer.append(svg("rect", { class: "spot outer", ...place }), svg("rect", { class: "spot", ...place }));
    });
    const said = el("p", { class: "play-said", "aria-live": "polite" });
    const bar = slider("snapshot", grids.length - 1, (i) => data.grids[i].name, (i) => { at = i; render(); });
    const closest = (pixels, pixel) => pixels.reduce((best, it, i) => (Math.abs(it - pixel) < Math.abs(pixels[best] - pixel) ? i : best), 0);
    function point(event) {
      const frame = plot.host.getBoundingClientRect();
      column = closest(data.x.map(plot.X), event.clientX - frame.left);
      row = closest(data.y.map(plot.Y), event.clientY - frame.top);
      render();
    }
    Object.entries({ tabindex: 0, role: "application", "aria-label": `${data.value_label}: the arrow keys move the place that is read off` })
      .forEach(([name, value]) => plot.host.setAttribute(name, value));
    plot.host.addEventListener("pointerdown", point);
    plot.host.addEventListener("pointermove", point);
    plot.host.addEventListener("keydown", (event) => {
      const move = { ArrowUp: [1, 0], ArrowDown: [-1, 0], ArrowLeft: [0, -1], ArrowRight: [0, 1] }[event.key];
      if (!move) return;
      event.preventDefault();
      row = Math.min(rows - 1, Math.max(0, row + move[0]));
      column = Math.min(columns - 1, Math.max(0, column + move[1]));
      render();
    });
    function render() {
      bar.set(at);
      plot.draw();
      said.textContent = `${data.grids[at].name}: ${data.value_label} ${fixed(grids[at][row * columns + column], 3)} at ${data.x_label} ${brief(data.x[column])}, ${data.y_label} ${brief(data.y[row])}.`;
    }
    const stops = [-1, -0.5, 0, 0.5, 1].map((t) => `rgb(${colour(t)})`).join(", ");
    const legend = el("div", { class: "play-legend" }, el("span", {}, brief(-data.limit)),
      el("span", { class: "ramp", style: `background: linear-gradient(90deg, ${stops})` }), el("span", {}, brief(data.limit)), el("span", {}, data.value_label));
    live.append(bar.element, plot.host, legend, said);
    render();
  };
})();
