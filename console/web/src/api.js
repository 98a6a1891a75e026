// Requests to the console's server. The token came in the address's fragment, which no server sees; it is kept for this
// tab and taken out of the address.
const stored = () => sessionStorage.getItem("selvedge-token") ?? "";

export function takeToken() {
  const given = new URLSearchParams(location.hash.slice(1)).get("token");
  if (!given) return;
  sessionStorage.setItem("selvedge-token", given);
  history.replaceState(null, "", location.pathname + location.search);
}

export const hasToken = () => stored() !== "";
export const page = crypto.getRandomValues(new Uint32Array(4)).join("-");

// The console takes this token no more: the tab forgets it.
export const forgetToken = () => sessionStorage.removeItem("selvedge-token");

// Throws an Error with the server's sentence and its status.
export async function result(response) {
  const body = await response.json().catch(() => ({}));
  if (!response.ok) throw Object.assign(new Error(body.error ?? `${response.status}`), { status: response.status });
  return body;
}

export const get = async (path) => result(await fetch(path));

export async function post(path, body = {}) {
  const headers = { "Content-Type": "application/json", "X-Selvedge-Token": stored(), "X-Selvedge-Page": page };
  return result(await fetch(path, { method: "POST", headers, body: JSON.stringify(body) }));
}

// Calls onState and onPreview as events come, onLink with whether they do.
export function listen({ onState, onPreview, onLink }) {
  let source, lastMs = 0;
  const connect = () => {
    source?.close();
    source = new EventSource("/api/events");
    source.addEventListener("state", (event) => {
      lastMs = performance.now();
      onLink(true);
      onState(JSON.parse(event.data));
    });
    source.addEventListener("preview", (event) => onPreview(JSON.parse(event.data)));
    source.onerror = () => onLink(false);
  };
  connect();
  // A server that was started again answers a new connection, and may not answer the old one.
  setInterval(() => {
    if (performance.now() - lastMs > 3000) {
      onLink(false);
      connect();
      lastMs = performance.now();
    }
  }, 1000);
}

// One at a time: a server that is slow to answer must not be sent ever more.
// onLost: what went wrong, and the status where the console answered.
export function beat(onLost) {
  let waits = false;
  setInterval(async () => {
    if (waits || !hasToken()) return;
    waits = true;
    await post("/api/heartbeat").catch((error) => onLost(error.message, error.status));
    waits = false;
  }, 500);
}
