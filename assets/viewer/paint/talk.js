// What the page and the program say to each other.

const secret = location.hash.slice(1);
const AGAIN = 2000;

/** Known at the program's address only; without it nothing can be sent. */
export const knowsSecret = secret !== "";

let posts = Promise.resolve();

/** Asks for something to be done, one after the other; gives the answer. */
export function post(what, body) {
  const done = posts.then(async () => {
    const answer = await fetch(`paint/${what}`, { method: "POST", headers: { "X-Secret": secret }, body: JSON.stringify(body ?? {}) });
    if (!answer.ok) throw new Error(await answer.text());
    return answer.json();
  });
  posts = done.catch(() => {});
  return done;
}

/** True until something else is asked for. */
export function sent() {
  const until = posts;
  return () => until === posts;
}

async function get(place, needed = true) {
  const answer = await fetch(`paint/${place}`, { cache: "no-store" });
  if (answer.status === 404 && !needed) return null;
  if (!answer.ok) throw new Error(await answer.text());
  return answer;
}

export const json = async (place) => (await get(place)).json();

/** A picture; null where it is not there and not needed. */
export async function bitmap(place, needed = true) {
  const answer = await get(place, needed);
  return answer && createImageBitmap(await answer.blob(), { colorSpaceConversion: "none", premultiplyAlpha: "default" });
}

/** Harmonics of the scene, as halves. */
export async function colors(doubt) {
  const answer = await get(doubt ? "colors/doubt" : "colors");
  return new Uint16Array(await answer.arrayBuffer());
}

/** Hands over every state of the painting, and the one before. */
export async function follow(news, heard) {
  for (;;) {
    try {
      const next = await (await get(`news/${news.version}`)).json();
      heard(next, news);
      news = next;
    } catch (error) {
      const gone = { ...news, version: 0, state: { phase: "gone" } };
      heard(gone, news);
      news = gone;
      await new Promise((done) => setTimeout(done, AGAIN));
    }
  }
}
