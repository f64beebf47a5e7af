/** Why something cannot be done: a message for people. */
export class MarathonError extends Error {
  override readonly name = "MarathonError";
  /** Files that a model names and that were not given. */
  readonly missing: readonly string[];

  constructor(message: string, missing: readonly string[] = []) {
    super(message);
    this.missing = missing;
  }
}
