/** Light and dark. The system's choice counts until the user makes one. */

export type Theme = "light" | "dark";

const KEY = "marathon.theme";

export class ThemeSwitch {
  readonly #system = matchMedia("(prefers-color-scheme: dark)");
  #listener: (theme: Theme) => void = () => {};

  constructor() {
    this.#system.addEventListener("change", () => this.#apply());
    this.#apply();
  }

  get theme(): Theme {
    const chosen = read();
    return chosen ?? (this.#system.matches ? "dark" : "light");
  }

  onChange(listener: (theme: Theme) => void): void {
    this.#listener = listener;
    listener(this.theme);
  }

  flip(): void {
    try {
      localStorage.setItem(KEY, this.theme === "dark" ? "light" : "dark");
    } catch {
      // storage may be forbidden: then the system's choice stays
    }
    this.#apply();
  }

  #apply(): void {
    document.documentElement.dataset["theme"] = this.theme;
    this.#listener(this.theme);
  }
}

function read(): Theme | null {
  try {
    const value = localStorage.getItem(KEY);
    return value === "light" || value === "dark" ? value : null;
  } catch {
    return null;
  }
}

/** Whether the user asks for little motion. */
export function reducedMotion(): boolean {
  return matchMedia("(prefers-reduced-motion: reduce)").matches;
}
