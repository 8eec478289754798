// Serves the pages, the viewers' modules and the splat files on this machine alone.

import { createServer } from 'node:http';
import { createReadStream, statSync } from 'node:fs';
import { extname, join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';

const HERE = fileURLToPath(new URL('..', import.meta.url));

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.json': 'application/json', '.wasm': 'application/wasm' };

/** `{ origin, share(path) → url, close() }`. */
export async function serve() {
  const shared = [];
  const server = createServer((request, response) => {
    const path = normalize(decodeURIComponent(new URL(request.url, 'http://host').pathname));
    const [, first, index] = path.split('/');
    const file = first === 'shared' ? shared[Number(index)] : ['pages', 'node_modules'].includes(first) && join(HERE, path);
    const size = file && statSync(file, { throwIfNoEntry: false })?.size;
    if (size === undefined || size === false) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'content-type': TYPES[extname(file)] ?? 'application/octet-stream', 'content-length': size });
    createReadStream(file).pipe(response);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const origin = `http://127.0.0.1:${server.address().port}`;
  return {
    origin,
    // The name stays in the address: viewers tell a format by it.
    share: (path) => `${origin}/shared/${shared.push(path) - 1}/${encodeURIComponent(path.split('/').pop())}`,
    close: () => server.close(),
  };
}
