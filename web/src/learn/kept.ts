/** Policies that the user keeps in the browser. */

export interface Kept {
  readonly name: string;
  readonly bytes: Uint8Array;
}

const PREFIX = "marathon.policy.";

function encode(bytes: Uint8Array): string {
  let text = "";
  for (const byte of bytes) text += String.fromCharCode(byte);
  return btoa(text);
}

/** Keeps a policy. Fails where the browser forbids storage or has no space left. */
export function keep(name: string, bytes: Uint8Array): void {
  localStorage.setItem(PREFIX + name, encode(bytes));
}

export function kept(): Kept[] {
  let keys: string[];
  try {
    keys = Object.keys(localStorage).filter((key) => key.startsWith(PREFIX));
  } catch {
    return [];
  }
  return keys.sort().flatMap((key) => {
    try {
      const bytes = Uint8Array.from(atob(localStorage.getItem(key) ?? ""), (character) => character.charCodeAt(0));
      return [{ name: key.slice(PREFIX.length), bytes }];
    } catch {
      // not of this page
      return [];
    }
  });
}

export function forget(name: string): void {
  localStorage.removeItem(PREFIX + name);
}
