// Sorting by depth, in a worker.

// Runs in the worker, and must not use anything outside itself.
function work() {
  const scenes = new Map();
  const buckets = new Uint32Array(65536);

  // One pass of a stable counting sort by 16 of the key's bits.
  function pass(keys, from, to, count, shift) {
    buckets.fill(0);
    for (let k = 0; k < count; k++) buckets[(keys[from[k]] >>> shift) & 0xffff]++;
    for (let b = 0, start = 0; b < 65536; b++) {
      const size = buckets[b];
      buckets[b] = start;
      start += size;
    }
    for (let k = 0; k < count; k++) {
      const i = from[k];
      to[buckets[(keys[i] >>> shift) & 0xffff]++] = i;
    }
  }

  // Those behind `near`, the farthest first. Bits of positive floats sort as the floats do;
  // among equal depths the last comes first, as shaders/sort.wgsl has it from the front.
  function sort(scene, [x, y, z, t], near) {
    const { means, keys, depths, a, b } = scene;
    const n = depths.length;
    let count = 0;
    for (let i = 0; i < n; i++) {
      const depth = x * means[3 * i] + y * means[3 * i + 1] + z * means[3 * i + 2] + t;
      depths[i] = depth;
      if (depth > near && depth < Infinity) a[count++] = i;
    }
    pass(keys, a, b, count, 0);
    pass(keys, b, a, count, 16);
    return a.slice(0, count).reverse();
  }

  onmessage = ({ data }) => {
    if (data.means) {
      const n = data.means.length / 3;
      const depths = new Float32Array(n);
      const keys = new Uint32Array(depths.buffer);
      const [a, b] = [new Uint32Array(n), new Uint32Array(n)];
      scenes.set(data.scene, { means: data.means, depths, keys, a, b });
    } else if (data.row) {
      const order = sort(scenes.get(data.scene), data.row, data.near);
      postMessage({ scene: data.scene, job: data.job, order }, [order.buffer]);
    } else {
      scenes.delete(data.scene);
    }
  };
}

/** Sorts scenes in a thread of their own. */
export class Sorter {
  constructor() {
    const url = URL.createObjectURL(new Blob([`(${work})()`], { type: "text/javascript" }));
    this.worker = new Worker(url);
    URL.revokeObjectURL(url);
    this.waiting = new Map();
    this.jobs = 0;
    this.worker.onmessage = ({ data }) => {
      this.waiting.get(data.job)?.(data.order);
      this.waiting.delete(data.job);
    };
  }

  add(scene, means) {
    const copy = means.slice();
    this.worker.postMessage({ scene, means: copy }, [copy.buffer]);
  }

  remove(scene) {
    this.worker.postMessage({ scene });
  }

  /** Indices from back to front along a depth row (x, y, z, t). */
  sort(scene, row, near) {
    const job = ++this.jobs;
    return new Promise((resolve) => {
      this.waiting.set(job, resolve);
      this.worker.postMessage({ scene, job, row, near });
    });
  }
}
