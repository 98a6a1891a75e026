// Fits, diagnoses and reports of the run.
import { get } from "./api.js";
import { by, element, number, say, short } from "./dom.js";

let listed = "", opened = "";

// The value within its 90 % interval, as a bar on a scale from a third to three times the value.
function interval(p) {
  const place = (v) => Math.max(0, Math.min(100, 50 + (50 * Math.log(Math.max(v, 1e-300) / p.value)) / Math.log(3)));
  const [low, high] = p.interval.map(place);
  return element(
    "div", { class: "interval" }, element("i", { style: `left:${low}%;width:${Math.max(1, high - low)}%` }),
    element("b", { style: "left:50%" }));
}

function fitCard(fit) {
  const rows =
    Object.entries(fit.parameters)
      .map(
        ([name, p]) => element(
          "tr", { class: p.determined ? "" : "faint" }, element("th", {}, name.replaceAll("_", " ")),
          element("td", { class: "figure" }, short(p.value)), element("td", {}, p.unit), element("td", {}, interval(p)),
          element(
            "td", { class: "sub" },
            p.at_bound     ? "at its bound" :
              p.determined ? "" :
                             "hardly determined")));
  return element(
    "section", { class: "result" }, element("h3", {}, `Fit of ${fit.campaign || fit.path}`),
    element("p", { class: "sub" }, `held-out error ${number(fit.held_out.error, 2)} mm`),
    element("table", {}, element("tbody", {}, ...rows)));
}

function diagnosisCard(d) {
  const likely = Object.entries(d.probabilities).sort((a, b) => b[1] - a[1]).slice(0, 6);
  return element(
    "section", { class: "result" }, element("h3", {}, `Diagnosis of ${d.campaign || d.path}`),
    element("p", { class: "big" }, d.cause),
    element("p", { class: "sub" }, `gap ${number(d.gap.value_mm, 2)} mm above the noise, p ${short(d.gap.p_value)}`),
    ...likely.map(
      ([name, p]) => element(
        "div", { class: "likely" }, element("span", {}, name),
        element("div", { class: "bar" }, element("i", { style: `width:${100 * p}%` })),
        element("span", { class: "figure" }, `${number(100 * p, 0)} %`))),
    element("p", { class: "sub" }, d.confirmation ?? ""),
    element("p", { class: "sub" }, d.next_experiment?.do ? `next: ${d.next_experiment.do}` : ""));
}

function mark() {
  for (const entry of by("report-list").children)
    entry.setAttribute("aria-selected", String(entry.dataset.path === opened));
}

export function open(path) {
  opened = path;
  by("report").src = "/run/" + path;
  mark();
}

export async function showResults() {
  const run = await get("/api/session");
  const text = JSON.stringify([run.fits, run.diagnoses, run.reports]);
  if (text === listed) return;
  listed = text;
  by("report-list")
    .replaceChildren(...run.reports.map(
      (path) => element(
        "button", { class: "entry", "data-path": path, onclick: () => open(path) },
        element("b", {}, path.replace(/\/?report\.html$/, "").replaceAll("/", " › ") || "the whole run"),
        element("small", {}, path))));
  if (!run.reports.length) by("report-list").append(element("p", { class: "empty-list" }, "no report yet"));
  by("summary").replaceChildren(...run.diagnoses.map(diagnosisCard), ...run.fits.map(fitCard));
  if (!run.fits.length && !run.diagnoses.length)
    by("summary").append(element("p", { class: "empty-list" }, "nothing fitted yet"));
  mark();
  if (run.reports.length && !by("report").src)
    open(run.reports.includes("report.html") ? "report.html" : run.reports[0]);
}
