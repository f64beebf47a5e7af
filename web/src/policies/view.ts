/** Policies: any policy of Marathon, from a file, a link or this browser. The file names its task. */
import type { PolicyInfo } from "marathon-rl";
import { button, el } from "../app/dom";
import { fetchBytes, pageUrl } from "../app/engine";
import { baseName, fileButton } from "../app/files";
import { optionsOf } from "../app/route";
import type { Context, View } from "../app/view";
import { forget, kept } from "../learn/kept";
import { Player } from "../play/player";
import { POLICIES, skinOf } from "../views/characters";

/** Largest policy, bytes. */
const MOST = 32e6;

interface Loaded {
  readonly name: string;
  readonly bytes: Uint8Array;
}

async function find({ params, files }: Context): Promise<Loaded> {
  const given = files.find(({ path }) => /\.(safetensors|onnx)$/i.test(path));
  if (given) return { name: baseName(given.path), bytes: given.bytes };
  const address = params.get("policy");
  if (address === null) return { name: "hopper", bytes: await fetchBytes(pageUrl("policies/hopper.safetensors"), MOST) };
  const url = POLICIES.includes(address) ? pageUrl(`policies/${address}.safetensors`) : new URL(address, document.baseURI);
  if (!/^https?:$/.test(url.protocol)) throw new Error(`${address} is not an address of the web`);
  return { name: baseName(url.pathname), bytes: await fetchBytes(url, MOST) };
}

class Policies implements View {
  readonly #context: Context;
  #player: Player | null = null;

  constructor(context: Context) {
    this.#context = context;
  }

  async show(): Promise<void> {
    const { panel, marathon } = this.#context;
    panel.replaceChildren(el("h2", {}, "Policies"));
    const { name, bytes } = await find(this.#context);
    this.#context.stay();
    const info = marathon.policyInfo(bytes);
    const agent = this.#context.params.get("agent") ?? info.agent;
    if (!marathon.agents().includes(agent)) {
      throw new Error(`${name} is for ${agent}, which this page does not have: 'marathon serve' shows it`);
    }
    this.#play(agent, bytes);
    panel.append(el("h3", {}, name), facts(info));
    this.#fill();
  }

  dispose(): void {
    this.#player?.dispose();
  }

  #play(agent: string, policy: Uint8Array): void {
    const options = optionsOf(this.#context.params);
    const env = Object.keys(options).length > 0 ? { policy, options } : { policy };
    this.#player = new Player(this.#context, { agent, env, distance: 4.8, skin: skinOf });
  }

  #fill(): void {
    const { panel, open, openFiles, fail } = this.#context;
    if (this.#player) panel.append(this.#player.controls);
    const shipped = el("div", { class: "row" });
    for (const name of POLICIES) shipped.append(button(name, () => open("policies", { policy: name })));
    const list = el("ul", { class: "list" });
    for (const { name, bytes } of kept()) {
      const item = el(
        "li",
        {},
        button(name, () => open("policies", {}, [{ path: `${name}.safetensors`, bytes }])),
        button("Remove", () => {
          try {
            forget(name);
            item.remove();
          } catch (error) {
            fail(error);
          }
        }, { "aria-label": `Remove ${name}` }),
      );
      list.append(item);
    }
    panel.append(
      el("p", {}, "Drop a .safetensors or .onnx file of Marathon anywhere on the page."),
      el("div", { class: "row" }, fileButton("Open a policy", ".safetensors,.onnx", false, (files) => void files.then(openFiles, fail))),
      el("h3", {}, "With the page"),
      shipped,
    );
    if (list.childElementCount > 0) panel.append(el("h3", {}, "Kept in this browser"), list);
  }
}

function facts({ agent, obs, act, options }: PolicyInfo): HTMLElement {
  const list = el("dl", { class: "facts" });
  const add = (name: string, value: string): void => list.append(el("dt", {}, name), el("dd", {}, value));
  add("Task", agent);
  add("Observation", `${obs} numbers`);
  add("Action", `${act} numbers`);
  for (const [name, value] of Object.entries(options)) add(name, String(value));
  return list;
}

export async function makePolicies(context: Context): Promise<View> {
  const view = new Policies(context);
  await view.show();
  return view;
}
