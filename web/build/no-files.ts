/** Stands for `node:fs/promises`, which the package uses in Node only. */
export function readFile(): Promise<never> {
  return Promise.reject(new Error("a page has no files"));
}
