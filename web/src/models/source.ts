/** Opens models: the module names the files that a model needs, and the page fetches or finds them. */
import { type Marathon, MarathonError, type Simulation } from "marathon-rl";
import { fetchBytes } from "../app/engine";
import { type GivenFile, baseName, extension } from "../app/files";
import { folderOf, normalize } from "./paths";

/** Most files of a model, most rounds of questions, most bytes. */
const MOST_FILES = 400;
const MOST_ROUNDS = 12;
const MOST_BYTES = 96e6;

export interface Opened {
  readonly simulation: Simulation;
  readonly name: string;
}

type Find = (path: string) => Promise<Uint8Array | null>;

/** A model at an address. Its files are beside it. */
export async function openAddress(marathon: Marathon, url: URL): Promise<Opened> {
  const xml = text(await fetchBytes(url, MOST_BYTES));
  const find: Find = (path) => fetchBytes(new URL(path, url), MOST_BYTES);
  return open(marathon, xml, baseName(url.pathname), find);
}

/** A model among files that were dropped. */
export async function openFiles(marathon: Marathon, files: readonly GivenFile[]): Promise<Opened> {
  const main = mainModel(files);
  if (!main) throw new Error("there is no model (.xml) among these files");
  const folder = folderOf(normalize(main.path));
  const find: Find = async (path) => {
    const wanted = normalize(folder + path);
    const exact = files.find((file) => normalize(file.path) === wanted);
    // files without their folder: the name must do
    const named = exact ?? files.find((file) => baseName(file.path) === baseName(wanted));
    return named?.bytes ?? null;
  };
  return open(marathon, text(main.bytes), baseName(main.path), find);
}

/** The model that no other one includes or attaches; among several, a scene, or the first. */
function mainModel(files: readonly GivenFile[]): GivenFile | undefined {
  const models = files.filter(({ path }) => /^(xml|mjcf)$/.test(extension(path)));
  if (models.length < 2) return models[0];
  const included = new Set(
    models.flatMap(({ bytes }) => [...text(bytes).matchAll(/<(?:include|model)\s[^>]*?file\s*=\s*["']([^"']+)["']/g)].map(([, file = ""]) => baseName(file))),
  );
  const tops = models.filter(({ path }) => !included.has(baseName(path)));
  return tops.find(({ path }) => baseName(path).startsWith("scene")) ?? tops[0] ?? models[0];
}

async function open(marathon: Marathon, xml: string, name: string, find: Find): Promise<Opened> {
  const given = new Map<string, Uint8Array>();
  let bytes = 0;
  for (let round = 0; ; round++) {
    try {
      return { simulation: marathon.simulation(xml, Object.fromEntries(given), name), name };
    } catch (error) {
      if (!(error instanceof MarathonError)) throw error;
      const asked = error.missing.filter((path) => !given.has(path));
      if (asked.length === 0 || round >= MOST_ROUNDS) throw error;
      const found = await Promise.all(asked.map(async (path) => [path, await find(path)] as const));
      const absent = found.filter(([, file]) => file === null).map(([path]) => path);
      if (absent.length > 0) throw new Error(`${name} needs ${list(absent)}: drop the whole folder`);
      for (const [path, file] of found) {
        if (file === null) continue;
        given.set(path, file);
        bytes += file.length;
      }
      if (bytes > MOST_BYTES || given.size > MOST_FILES) throw new Error(`the files of ${name} are too large`);
    }
  }
}

function list(names: readonly string[]): string {
  const some = names.slice(0, 3).join(", ");
  return names.length > 3 ? `${some} and ${names.length - 3} more files` : some;
}

/** The text of a file. Bytes that are no text are refused by the module with a message of its own. */
function text(bytes: Uint8Array): string {
  return new TextDecoder().decode(bytes);
}
