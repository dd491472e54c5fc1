// Formulas come last, when the page has been painted. A link lands again once all above its target
// has its size, unless the reader has moved on.
(() => {
  let moved = false;
  for (const kind of ["wheel", "touchmove", "keydown", "pointerdown"])
    addEventListener(kind, () => (moved = true), { once: true, passive: true });
  const land = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (target && !moved) target.scrollIntoView();
  };
  const set = () => {
    const formulas = document.querySelector('meta[name="mathjax"]');
    if (!formulas) return;
    const script = document.createElement("script");
    script.src = formulas.content;
    script.onload = () => MathJax.startup.promise.then(land);
    document.head.append(script);
  };
  addEventListener("load", () => {
    land();
    requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(set)));
  });
})();
