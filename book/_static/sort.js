// Tables of class "sortable": a click on a heading sorts the rows by it, a second one backwards.
(() => {
  // A number only if the whole first word is one: "3a" is a name. The interval behind it is ignored.
  const number = (text) => {
    const [word] = text.replace(/^[-−]/, "-").split(/\s/, 1);
    if (/^-?∞$/.test(word)) return word === "∞" ? Infinity : -Infinity;
    return /^-?[\d.,]+(e-?\d+)?$/.test(word) ? Number(word.replaceAll(",", "")) : Number.NaN;
  };
  const compare = (a, b) => {
    const [x, y] = [number(a), number(b)];
    if (Number.isNaN(x) || Number.isNaN(y)) return a.localeCompare(b, "en", { numeric: true });
    return x === y ? 0 : x - y;
  };
  for (const table of document.querySelectorAll("table.sortable")) {
    const headings = [...table.tHead.rows[0].cells];
    headings.forEach((heading, column) => {
      heading.addEventListener("click", () => {
        const direction = heading.ariaSort === "ascending" ? -1 : 1;
        const key = (row) => row.cells[column].textContent.trim();
        const rows = [...table.tBodies[0].rows];
        rows.sort((a, b) => direction * compare(key(a), key(b)));
        table.tBodies[0].append(...rows);
        headings.forEach((other) => (other.ariaSort = null));
        heading.ariaSort = direction === 1 ? "ascending" : "descending";
      });
    });
  }
})();
