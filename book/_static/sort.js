// Tables of class "sortable": a click on a heading sorts the rows by it, a second one backwards.
document.addEventListener("DOMContentLoaded", () => {
  const number = (text) => Number.parseFloat(text.replaceAll(",", "").replace("∞", "Infinity"));
  const compare = (a, b) => {
    const [x, y] = [number(a), number(b)];
    return Number.isNaN(x) || Number.isNaN(y) ? a.localeCompare(b, "en", { numeric: true }) : x - y;
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
});
