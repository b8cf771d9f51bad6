// A wide table, drawing or piece of code scrolls sideways; the arrow keys scroll it if it can have the focus.
const makeScrollable = () =>
  document.querySelectorAll(".md-typeset__scrollwrap, .md-typeset pre > code, .md-typeset p:has(> img)").forEach((element) => {
    if (element.scrollWidth > element.clientWidth) element.tabIndex = 0;
  });
addEventListener("load", () => requestAnimationFrame(makeScrollable));
addEventListener("resize", makeScrollable);
