/** Files that the user drops or chooses. */
import { el } from "./dom";
import { tooLarge } from "./engine";

export interface GivenFile {
  /** Path within what was dropped, with slashes. */
  readonly path: string;
  readonly bytes: Uint8Array;
}

/** Most files of one drop, and most bytes of all together. */
const MOST_FILES = 600;
const MOST_BYTES = 128e6;

/** The extension of a path, in lower case, without the dot. */
export function extension(path: string): string {
  return /\.([^./\\]+)$/.exec(path)?.[1]?.toLowerCase() ?? "";
}

export function baseName(path: string): string {
  return path.slice(path.lastIndexOf("/") + 1);
}

/** Reads what was dropped, folders included. */
export async function droppedFiles(data: DataTransfer): Promise<GivenFile[]> {
  // entries must be asked for before the first await: the data is gone after that
  const entries = [...data.items].map((item) => item.webkitGetAsEntry?.() ?? null);
  const plain = [...data.files];
  if (entries.every((entry) => entry === null)) return readFiles(plain.map((file) => [file.name, file]));
  const found: [string, File][] = [];
  for (const entry of entries) if (entry) await walk(entry, found);
  return readFiles(found);
}

/** Reads what was chosen in a dialog. */
export function chosenFiles(files: FileList): Promise<GivenFile[]> {
  return readFiles([...files].map((file) => [file.webkitRelativePath || file.name, file]));
}

async function walk(entry: FileSystemEntry, found: [string, File][]): Promise<void> {
  if (found.length > MOST_FILES) throw new Error(`these are more than ${MOST_FILES} files`);
  if (entry.isFile) {
    const file = await new Promise<File>((resolve, reject) => (entry as FileSystemFileEntry).file(resolve, reject));
    found.push([entry.fullPath.replace(/^\//, ""), file]);
    return;
  }
  const reader = (entry as FileSystemDirectoryEntry).createReader();
  for (;;) {
    // a reader returns a hundred entries at a time
    const some = await new Promise<FileSystemEntry[]>((resolve, reject) => reader.readEntries(resolve, reject));
    if (some.length === 0) return;
    for (const child of some) await walk(child, found);
  }
}

async function readFiles(files: readonly (readonly [string, File])[]): Promise<GivenFile[]> {
  if (files.length > MOST_FILES) throw new Error(`these are more than ${MOST_FILES} files`);
  if (files.reduce((sum, [, { size }]) => sum + size, 0) > MOST_BYTES) throw tooLarge("this drop", MOST_BYTES);
  return Promise.all(files.map(async ([path, file]) => ({ path, bytes: new Uint8Array(await file.arrayBuffer()) })));
}

/** A button that opens a dialog for files. */
export function fileButton(label: string, accept: string, multiple: boolean, onFiles: (files: Promise<GivenFile[]>) => void): HTMLElement {
  const input = el("input", {
    type: "file",
    accept,
    multiple,
    class: "visually-hidden",
    change: () => {
      if (input.files && input.files.length > 0) onFiles(chosenFiles(input.files));
      // the same file can be chosen again
      input.value = "";
    },
  });
  return el("label", { class: "button file" }, label, input);
}
