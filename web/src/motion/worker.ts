/** Imports a recording in a thread of its own: fitting a motion to a body takes seconds. */
import { load } from "marathon-rl";
import type { Imported, Recording } from "./import";

interface WorkerScope {
  onmessage: ((event: MessageEvent<Recording>) => void) | null;
  postMessage(message: Imported): void;
}
const scope = self as unknown as WorkerScope;

scope.onmessage = ({ data }) => {
  void run(data).then(
    (imported) => scope.postMessage(imported),
    (error: unknown) => scope.postMessage({ error: error instanceof Error ? error.message : String(error) }),
  );
};

async function run({ base, lanes, character, name, bytes, files }: Recording): Promise<Imported> {
  const marathon = await load({ base, lanes });
  const clip = marathon.importMotion(character, name, bytes, files);
  return { motion: clip.bytes(), warnings: clip.warnings };
}
