/** Trains in a thread of its own, with its own instance of the module. */
import { type Trainer, load } from "marathon-rl";
import type { FromWorker, ToWorker } from "./messages";

/** Time between two policies that the page gets, ms. */
const POLICY_EVERY = 500;

// the types of the page describe a window
interface WorkerScope {
  onmessage: ((event: MessageEvent<ToWorker>) => void) | null;
  postMessage(message: FromWorker, transfer: Transferable[]): void;
}
const scope = self as unknown as WorkerScope;
const send = (message: FromWorker, transfer: Transferable[] = []): void => scope.postMessage(message, transfer);

let trainer: Trainer | null = null;
let running = false;
let seconds = 0;
let sent = 0;

scope.onmessage = ({ data }: MessageEvent<ToWorker>) => {
  if (data.type === "start") {
    void start(data).catch((error: unknown) => {
      send({ type: "error", message: error instanceof Error ? error.message : String(error) });
    });
  } else {
    const before = running;
    running = data.type === "continue";
    if (running && !before) iterate();
  }
};

async function start({ base, lanes, agent, config }: Extract<ToWorker, { type: "start" }>): Promise<void> {
  const marathon = await load({ base, lanes });
  trainer = marathon.trainer(agent, config);
  running = true;
  iterate();
}

function iterate(): void {
  if (trainer === null || !running || trainer.done) return;
  try {
    const begin = performance.now();
    const iteration = trainer.iterate();
    const now = performance.now();
    seconds += (now - begin) / 1000;
    send({ type: "point", iteration, seconds });
    if (now - sent > POLICY_EVERY || trainer.done) {
      sent = now;
      const bytes = trainer.policy();
      send({ type: "policy", bytes, done: trainer.done }, [bytes.buffer]);
    }
  } catch (error) {
    running = false;
    send({ type: "error", message: error instanceof Error ? error.message : String(error) });
    return;
  }
  // a pause of the page comes in between
  setTimeout(iterate);
}
