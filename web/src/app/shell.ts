/** The page around the views: header, picture, panel, messages, drops and links. */
import { reducedMotion, ThemeSwitch } from "./theme";
import { button, download, el } from "./dom";
import { engine, restartEngine } from "./engine";
import { type GivenFile, droppedFiles, extension } from "./files";
import { Messages, reason } from "./messages";
import { type Route, VIEWS, type ViewName, isEmbedded, linkOf, parseRoute, tidy } from "./route";
import type { MakeView, View } from "./view";
import { Stage } from "../scene/stage";
import { makePlay } from "../play/view";

const NAMES: Record<ViewName, string> = { play: "Play", learn: "Learn", models: "Models", motion: "Motion", policies: "Policies", live: "Live" };

/** Views load when they are opened; the first one comes with the page. */
const LOADERS: Record<ViewName, () => Promise<MakeView>> = {
  play: async () => makePlay,
  learn: async () => (await import("../learn/view")).makeLearn,
  models: async () => (await import("../models/view")).makeModels,
  motion: async () => (await import("../motion/view")).makeMotion,
  policies: async () => (await import("../policies/view")).makePolicies,
  live: async () => (await import("../live/view")).makeLive,
};

const KINDS: Readonly<Record<string, ViewName>> = {
  xml: "models",
  mjcf: "models",
  bvh: "motion",
  glb: "motion",
  gltf: "motion",
  vrm: "motion",
  motion: "motion",
  safetensors: "policies",
  onnx: "policies",
};

/** For tests, and for pages of the same origin that embed this one. */
export interface PageHandle {
  view: View | null;
  name: ViewName | null;
  stage: Stage;
  engine: typeof engine;
}

declare global {
  interface Window {
    marathonPage?: PageHandle;
  }
}

/** A view with the files that it was opened for. */
interface Shown {
  readonly route: Route;
  readonly files: readonly GivenFile[];
}

class Shell {
  readonly #messages = new Messages();
  readonly #theme = new ThemeSwitch();
  readonly #canvas = el("canvas", { tabindex: 0, role: "application", "aria-label": "Picture of the simulation" });
  readonly #overlay = el("div", { class: "overlay" });
  readonly #panel = el("div", { class: "panel-body", id: "panel" });
  readonly #fold = button("Controls", () => this.#setFolded(!this.#side.classList.contains("folded")), { class: "fold", "aria-controls": "panel" });
  readonly #side = el("section", { class: "panel", "aria-label": "Controls" });
  readonly #links = new Map<ViewName, HTMLAnchorElement>();
  readonly #stage: Stage;
  readonly #handle: PageHandle;
  #route: Route = parseRoute(new URL(location.href));
  /** What is shown, and what was shown before. */
  #shown: Shown | null = null;
  #before: Shown | null = null;
  /** Number of the view that is being opened. */
  #turn = 0;

  constructor(root: HTMLElement) {
    const embedded = isEmbedded(new URL(location.href));
    document.documentElement.classList.toggle("embedded", embedded);
    const stageBox = el("div", { class: "stage" }, this.#canvas);
    this.#side.append(this.#fold, this.#panel);
    const main = el("main", { id: "main" }, stageBox, this.#overlay, this.#side);
    root.replaceChildren(embedded ? this.#corner() : this.#header(), main, this.#messages.element);
    this.#stage = new Stage(this.#canvas, reducedMotion());
    new ResizeObserver(() => this.#uncover()).observe(this.#side);
    this.#theme.onChange((theme) => this.#stage.setTheme(theme));
    this.#handle = { view: null, name: null, stage: this.#stage, engine };
    window.marathonPage = this.#handle;
    // a click leaves the focus on a button, where Space would press it again
    root.addEventListener("click", ({ target, detail }) => {
      if (detail > 0 && target instanceof HTMLElement && target.closest("button")) this.#canvas.focus({ preventScroll: true });
    });
    this.#listenForDrops();
    addEventListener("hashchange", () => {
      const next = parseRoute(new URL(location.href));
      if (linkOf(next) !== linkOf(this.#route)) void this.#open(next, []);
    });
    history.replaceState(null, "", tidy(new URL(location.href)));
    void this.#open(this.#route, []);
  }

  #header(): HTMLElement {
    const nav = el("nav", { "aria-label": "Views" });
    // only a program that serves the page has something live
    for (const view of VIEWS.filter((name) => name !== "live" || this.#route.view === "live")) {
      const link = el("a", { href: view === "live" ? linkOf(this.#route) : `#/${view}` }, NAMES[view]);
      this.#links.set(view, link);
      nav.append(link);
    }
    const logo = el("img", { src: "favicon.svg", alt: "", width: 26, height: 26 });
    const tools = el(
      "div",
      { class: "tools" },
      button("Link", () => void this.#copyLink(), { title: "Copy the link of this view", "aria-label": "Copy the link of this view" }),
      button("Picture", () => void this.#picture(), { title: "Save a picture", "aria-label": "Save a picture" }),
      button("◐", () => this.#theme.flip(), { class: "icon", title: "Dark or light", "aria-label": "Switch between dark and light" }),
    );
    return el("header", {}, el("a", { href: "#/play", class: "logo" }, logo, el("h1", {}, "Marathon")), nav, tools);
  }

  /** In another page, only a link to the full one. */
  #corner(): HTMLElement {
    const link = el("a", { class: "corner", target: "_blank", rel: "noopener", href: "./" }, "Marathon");
    // the link follows the view
    link.addEventListener("pointerdown", () => (link.href = `./${linkOf(this.#route)}`));
    return el("header", { class: "slim" }, el("h1", { class: "visually-hidden" }, "Marathon"), link);
  }

  #setFolded(folded: boolean): void {
    this.#side.classList.toggle("folded", folded);
    this.#fold.setAttribute("aria-expanded", String(!folded));
  }

  /** Shows the figure beside the panel, or above it on a narrow screen. */
  #uncover(): void {
    const { offsetLeft, offsetTop, offsetWidth, parentElement } = this.#side;
    const folded = this.#side.classList.contains("folded");
    const below = narrow() && offsetTop > 100;
    this.#stage.setCovered(
      folded || narrow() ? 0 : offsetLeft + offsetWidth,
      folded || !below ? 0 : (parentElement?.clientHeight ?? 0) - offsetTop,
    );
  }

  async #open(route: Route, files: readonly GivenFile[]): Promise<void> {
    const turn = ++this.#turn;
    const gone = (): boolean => turn !== this.#turn;
    this.#route = route;
    this.#messages.clear();
    this.#close();
    for (const [view, link] of this.#links) {
      if (view === route.view) link.setAttribute("aria-current", "page");
      else link.removeAttribute("aria-current");
    }
    document.documentElement.dataset["view"] = route.view;
    // views with thumb controls begin with a free picture
    this.#setFolded(isEmbedded(new URL(location.href)) || (narrow() && (route.view === "play" || route.view === "policies")));
    document.title = `${NAMES[route.view]} · Marathon`;
    this.#overlay.append(el("p", { class: "loading", role: "status" }, "Loading"));
    try {
      const [marathon, make] = await Promise.all([engine(), LOADERS[route.view]().catch(reload)]);
      if (gone()) return;
      this.#overlay.replaceChildren();
      const view = await make({
        stage: this.#stage,
        marathon,
        panel: this.#panel,
        overlay: this.#overlay,
        params: route.params,
        files,
        stay: () => {
          if (gone()) throw new Error("this view has been left");
        },
        say: (text, kind) => this.#messages.say(text, kind),
        fail: (error) => {
          if (!gone()) this.#fail(error);
        },
        giveUp: (error) => {
          if (!gone()) void this.#goBack(error, this.#route, this.#before);
        },
        link: (settings) => this.#link(settings),
        open: (name, params, given = []) => this.#go({ view: name, params: new URLSearchParams(params) }, given),
        openFiles: (given) => this.#openFiles(given),
      });
      if (gone()) {
        view.dispose();
        return;
      }
      this.#handle.view = view;
      this.#handle.name = route.view;
      this.#before = this.#shown;
      this.#shown = { route: this.#route, files };
      document.documentElement.dataset["ready"] = route.view;
      performance.mark("marathon-ready");
    } catch (error) {
      if (gone()) return;
      this.#overlay.replaceChildren();
      await this.#goBack(error, route, this.#shown);
    }
  }

  /** Says why a view failed, and shows what there was before, or that view without its settings. */
  async #goBack(error: unknown, failed: Route, before: Shown | null): Promise<void> {
    this.#shown = this.#before = null;
    // without settings there is nothing to go back to
    if (!isLost(error) && (before !== null || failed.params.size > 0)) {
      const { route, files } = before ?? { route: { view: failed.view, params: new URLSearchParams() }, files: [] };
      history.replaceState(null, "", linkOf(route));
      await this.#open(route, files);
    }
    this.#fail(error);
  }

  #close(): void {
    delete document.documentElement.dataset["ready"];
    try {
      this.#handle.view?.dispose();
    } catch (error) {
      // what a module held is gone with it
      if (!isLost(error)) throw error;
    }
    this.#handle.view = this.#handle.name = null;
    this.#stage.clear();
    this.#panel.replaceChildren();
    this.#overlay.replaceChildren();
  }

  #go(route: Route, files: readonly GivenFile[]): void {
    const url = new URL(location.href);
    url.hash = linkOf(route);
    history.pushState(null, "", url);
    void this.#open(route, files);
  }

  #link(settings: Readonly<Record<string, string | null>>): void {
    const params = new URLSearchParams(this.#route.params);
    for (const [name, value] of Object.entries(settings)) {
      if (value === null) params.delete(name);
      else params.set(name, value);
    }
    this.#route = { view: this.#route.view, params };
    history.replaceState(null, "", linkOf(this.#route));
  }

  #fail(error: unknown): void {
    const text = reason(error);
    this.#messages.say(text, "error");
    if (!isLost(error)) return;
    // the instance is lost, but not its code
    const again = async (): Promise<void> => {
      await restartEngine();
      await this.#open({ view: this.#route.view, params: new URLSearchParams() }, []);
      this.#messages.say(text, "error");
    };
    again().catch((failure: unknown) => this.#messages.say(`${text} (${reason(failure)})`, "error"));
  }

  async #copyLink(): Promise<void> {
    const url = new URL(location.href);
    url.search = "";
    url.hash = linkOf(this.#route);
    try {
      await navigator.clipboard.writeText(url.href);
      this.#messages.say("The link is in the clipboard.");
    } catch {
      this.#messages.say(url.href);
    }
  }

  async #picture(): Promise<void> {
    const picture = await this.#stage.picture();
    if (picture) download(`marathon-${this.#route.view}.png`, picture);
    else this.#messages.say("This browser cannot save the picture.", "error");
  }

  #listenForDrops(): void {
    const target = document.documentElement;
    target.addEventListener("dragover", (event) => {
      event.preventDefault();
      target.classList.add("dropping");
    });
    target.addEventListener("dragleave", (event) => {
      if (event.relatedTarget === null) target.classList.remove("dropping");
    });
    target.addEventListener("drop", (event) => {
      event.preventDefault();
      target.classList.remove("dropping");
      if (!event.dataTransfer) return;
      droppedFiles(event.dataTransfer).then(
        (files) => this.#openFiles(files),
        (error: unknown) => this.#fail(error),
      );
    });
  }

  /** Opens the view for the kind of files that were dropped. */
  #openFiles(files: readonly GivenFile[]): void {
    const [first] = files;
    if (!first) return;
    const known = files.find(({ path }) => KINDS[extension(path)] !== undefined);
    const view = known && KINDS[extension(known.path)];
    if (view) {
      // models come with meshes in glTF; a model decides
      const model = files.some(({ path }) => KINDS[extension(path)] === "models");
      this.#go({ view: model ? "models" : view, params: new URLSearchParams() }, files);
    } else if (extension(first.path) === "zip") {
      this.#messages.say(`${first.path} is an archive; unpack it and drop its folder.`, "error");
    } else {
      this.#messages.say(`${first.path} is not a model (.xml), a recording (.bvh, .glb, .gltf) or a policy (.safetensors, .onnx).`, "error");
    }
  }
}

/** Key of the time of the last reload, ms. */
const RELOADED = "marathon.reloaded";

/** The code of a view cannot be loaded: with a newer build its name is another one, so the page is loaded again, once. */
function reload(error: unknown): never {
  const now = Date.now();
  try {
    if (now - Number(sessionStorage.getItem(RELOADED) ?? 0) > 60_000) {
      sessionStorage.setItem(RELOADED, String(now));
      location.reload();
    }
  } catch {
    // without storage the page could reload for ever
  }
  throw new Error(`this part of the page cannot be loaded; load the page again (${reason(error)})`);
}

/** Whether the module has stopped. */
function isLost(error: unknown): boolean {
  return /module has stopped|out of memory|unreachable/.test(reason(error));
}

/** Whether the panel has no place beside the figure. */
function narrow(): boolean {
  return innerWidth <= 760;
}

export function start(root: HTMLElement): void {
  try {
    new Shell(root);
  } catch (error) {
    // no WebGL, for example
    root.replaceChildren(el("p", { class: "loading", role: "alert" }, `Marathon cannot start: ${reason(error)}`));
  }
}
