/** Lets the browser load the code of the scene together with the first script, and not after it. */
import type { HtmlTagDescriptor, Plugin } from "vite";

export function preload(entry: string): Plugin {
  return {
    name: "preload",
    apply: "build",
    transformIndexHtml: {
      order: "post",
      handler(_html, { bundle }) {
        const chunks = Object.values(bundle ?? {}).flatMap((item) => (item.type === "chunk" ? [item] : []));
        const start = chunks.find((chunk) => chunk.facadeModuleId?.endsWith(entry));
        const files = start ? [start.fileName, ...start.imports] : [];
        return [...new Set(files)].map(
          (file): HtmlTagDescriptor => ({ tag: "link", attrs: { rel: "modulepreload", crossorigin: true, href: `./${file}` }, injectTo: "head" }),
        );
      },
    },
  };
}
