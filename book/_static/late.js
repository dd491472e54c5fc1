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
    script.onload = async () => {
      await MathJax.startup.promise;
      // What is in sight or above it at once; below, one by one: the page can be used meanwhile.
      const all = [...document.querySelectorAll(".math")];
      const below = all.filter((it) => it.getBoundingClientRect().top > innerHeight);
      for (const some of [all.filter((it) => !below.includes(it)), ...below.map((it) => [it])]) {
        await MathJax.typesetPromise(some);
        await new Promise((done) => setTimeout(done));
      }
      document.documentElement.dataset.formulas = "set";
      land();
    };
    MathJax.startup = { typeset: false };
    document.head.append(script);
  };
  addEventListener("load", () => {
    land();
    requestAnimationFrame(() => requestAnimationFrame(() => setTimeout(set)));
  });
})();
