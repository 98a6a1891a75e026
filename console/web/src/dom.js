// Small helpers for the page.
export const by = (id) => document.getElementById(id);

export function element(tag, attributes = {}, ...children) {
  const made = document.createElement(tag);
  for (const [key, value] of Object.entries(attributes)) {
    if (key.startsWith("on")) made.addEventListener(key.slice(2), value);
    else if (value !== null && value !== undefined && value !== false)
      made.setAttribute(key, value === true ? "" : value);
  }
  made.append(...children.filter((child) => child !== null && child !== undefined)
                .map((child) => (child instanceof Node ? child : document.createTextNode(child))));
  return made;
}

// Text only where it changed: a page read aloud must not repeat itself.
export function say(node, text) { if (node.textContent !== text) node.textContent = text; }

export const number = (value, digits = 1) => (Number.isFinite(value) ? value.toFixed(digits) : "–");
// Three significant digits.
export const short = (value) =>
  (Number.isFinite(value) ? (Math.abs(value) >= 1e-2 && Math.abs(value) < 1e5 ? String(Number(value.toPrecision(3))) :
                                                                                value.toExponential(2)) :
                            "–");

export function notice(text, kind = "bad") {
  const box = by("notice");
  box.hidden = !text;
  box.className = kind;
  say(box, text ?? "");
  clearTimeout(notice.timer);
  if (text) notice.timer = setTimeout(() => { box.hidden = true; }, 8000);
}
