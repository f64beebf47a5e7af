/** Start of the page: the module and the first policy load while the code of the scene does. */
import "./style.css";
import { engine, policy } from "./app/engine";
import { parseRoute } from "./app/route";
import { characterOf } from "./views/characters";

const { view, params } = parseRoute(new URL(location.href));
// the view handles their errors
engine().catch(() => {});
if (view === "play") void (async () => policy(characterOf(params.get("agent")).policy))().catch(() => {});

const { start } = await import("./app/shell");
start(document.getElementById("app") ?? document.body);

// what a program serves is never older than the program
if ("serviceWorker" in navigator && import.meta.env.PROD && view !== "live") {
  const register = async (): Promise<void> => {
    try {
      await navigator.serviceWorker.register("sw.js");
      const { active } = await navigator.serviceWorker.ready;
      active?.postMessage({ loaded: performance.getEntriesByType("resource").map((entry) => entry.name) });
    } catch {
      // without a worker the page still works, with a network
    }
  };
  // after the first seconds of play, which should not share the network
  setTimeout(() => void register(), 4000);
}
