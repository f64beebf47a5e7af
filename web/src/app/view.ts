/** The interface between the page and its views. */
import type { Marathon } from "marathon-rl";
import type { Stage } from "../scene/stage";
import type { GivenFile } from "./files";
import type { Kind } from "./messages";
import type { ViewName } from "./route";

export interface Context {
  readonly stage: Stage;
  readonly marathon: Marathon;
  /** Place for the view's controls. */
  readonly panel: HTMLElement;
  /** Place on the picture, for text and thumb controls. */
  readonly overlay: HTMLElement;
  readonly params: URLSearchParams;
  /** Files to open, from another view. */
  readonly files: readonly GivenFile[];
  /** Throws if the user has gone to another view: what loads late must not appear. The page ignores the error. */
  stay(): void;
  say(text: string, kind?: Kind): void;
  /** Says why something failed, and replaces a module that has stopped. */
  fail(error: unknown): void;
  /** Says why the view cannot show what it was opened for, and goes back to what there was before. */
  giveUp(error: unknown): void;
  /** Writes settings into the link of the view. `null` removes one. */
  link(settings: Readonly<Record<string, string | null>>): void;
  /** Goes to another view. */
  open(view: ViewName, params: Readonly<Record<string, string>>, files?: readonly GivenFile[]): void;
  /** Opens a view for files by their kind. */
  openFiles(files: readonly GivenFile[]): void;
}

export interface View {
  dispose(): void;
}

/** Shows a view. If that fails, nothing of it is left. */
export async function shown<V extends View & { show(): Promise<void> }>(view: V): Promise<V> {
  try {
    await view.show();
  } catch (error) {
    view.dispose();
    throw error;
  }
  return view;
}

export type MakeView = (context: Context) => View | Promise<View>;
