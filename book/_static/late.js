// What a page says is painted first. Then come the scripts, in their order, and the formulas. A link
// lands again once all above its target has its size, unless the reader has moved on.
(() => {
  let moved = false;
  for (const kind of ["wheel", "touchmove", "keydown", "pointerdown"])
    addEventListener(kind, () => (moved = true), { once: true, passive: true });
  const land = () => {
    const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
    if (target && !moved) target.scrollIntoView();
  };
  // Between two pieces of work the page answers its reader.
  const pause = () => new Promise((done) => setTimeout(done));
  // A page behind others is not painted; its scripts come all the same.
  const painted = () =>
    new Promise((done) => {
      new PerformanceObserver(done).observe({ type: "paint", buffered: true });
      setTimeout(done, 1000);
    });
  const run = (attributes) =>
    new Promise((done) => {
      const script = document.createElement("script");
      for (const { name, value } of attributes) script.setAttribute(name, value);
      script.type = "text/javascript";
      script.async = false;
      script.onload = script.onerror = done;
      document.head.append(script);
    });
  // A formula too wide for its line is set smaller, down to four fifths of the text around it.
  const fit = (it) => {
    const formula = it.querySelector('mjx-container[display="true"]');
    if (!formula || formula.scrollWidth <= formula.clientWidth) return;
    const size = (parseFloat(formula.style.fontSize) * formula.clientWidth) / formula.scrollWidth;
    formula.style.fontSize = `${Math.max(80, Math.floor(size))}%`;
  };
  async function formulas() {
    const mathjax = document.querySelector('meta[name="mathjax"]');
    if (!mathjax) return;
    MathJax.startup = { typeset: false };
    await run([{ name: "src", value: mathjax.content }]);
    await MathJax.startup.promise;
    // What is in sight or above it at once; below, one by one: the page can be used meanwhile.
    const all = [...document.querySelectorAll(".math")];
    const below = all.filter((it) => it.getBoundingClientRect().top > innerHeight);
    for (const some of [all.filter((it) => !below.includes(it)), ...below.map((it) => [it])]) {
      await MathJax.typesetPromise(some);
      some.forEach(fit);
      await pause();
    }
  }
  // Of a film its first picture, when it comes near.
  const near = new IntersectionObserver((films) => {
    for (const { target, isIntersecting } of films) if (isIntersecting) target.preload = "metadata";
  }, { rootMargin: "800px" });
  addEventListener("load", async () => {
    land();
    await painted();
    const scripts = [...document.querySelectorAll('script[type="text/late"]')];
    await Promise.all(scripts.map((it) => run(it.attributes)));
    for (const host of window.play?.hosts() ?? []) {
      play.build([host]);
      await pause();
    }
    land();
    for (const film of document.querySelectorAll("video")) near.observe(film);
    await formulas();
    document.documentElement.dataset.formulas = "set";
    land();
  });
})();
