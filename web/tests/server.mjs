// A small static server for tests. The page is in a folder, as on many hosts.
import { readFile } from "node:fs/promises";
import { createServer } from "node:http";
import { extname, join, normalize } from "node:path";
import { fileURLToPath } from "node:url";

const DIST = fileURLToPath(new URL("../dist/", import.meta.url));
const TYPES = {
  ".html": "text/html; charset=utf-8",
  ".js": "text/javascript",
  ".css": "text/css",
  ".svg": "image/svg+xml",
  ".wasm": "application/wasm",
  ".xml": "application/xml",
};
export const FOLDER = "/some/folder/";

/** Starts a server. `extra` are more files by path, `folders` more folders. `requests` collects the paths that were asked for. */
export async function serve(extra = {}, folders = {}) {
  const requests = [];
  const server = createServer(async (request, response) => {
    const path = decodeURIComponent(new URL(request.url, "http://localhost").pathname);
    requests.push(path);
    const inside = path.startsWith(FOLDER) ? normalize(path.slice(FOLDER.length)) || "index.html" : null;
    try {
      const start = Object.keys(folders).find((start) => path.startsWith(start) && !normalize(path).includes(".."));
      const given = start === undefined ? extra[path] : await readFile(join(folders[start], normalize(path.slice(start.length))));
      if (given === undefined && (inside === null || inside.startsWith(".."))) throw new Error("outside");
      const name = inside === "." ? "index.html" : inside;
      const bytes = given ?? (await readFile(join(DIST, name)));
      const type = TYPES[extname(given === undefined ? name : path)] ?? "application/octet-stream";
      response.writeHead(200, { "content-type": type, "content-length": Buffer.byteLength(bytes) });
      response.end(bytes);
    } catch {
      response.writeHead(404, { "content-type": "text/plain" });
      response.end("not found");
    }
  });
  await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));
  const { port } = server.address();
  return {
    url: `http://127.0.0.1:${port}${FOLDER}`,
    origin: `http://127.0.0.1:${port}`,
    requests,
    close: () => {
      server.closeAllConnections();
      return new Promise((resolve) => server.close(resolve));
    },
  };
}
