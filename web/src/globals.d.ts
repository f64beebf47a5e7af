/** Folder of the WebAssembly modules in the page, without a slash at its end. */
declare const __WASM_FOLDER__: string;
