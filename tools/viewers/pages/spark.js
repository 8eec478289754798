// Spark: three.js' WebGL renderer with Gaussians, set as 3D Gaussian splatting draws.

import * as THREE from 'three';
import { SparkRenderer, SplatMesh } from '@sparkjsdev/spark';
import { take } from './camera.js';

// How often sorting may take another turn before it is given up.
const TURNS = 600;

export const open = (...what) => openWith({}, ...what);

export async function openWith(kept, canvas, url, [width, height], matrix) {
  const renderer = new THREE.WebGLRenderer({ canvas, antialias: false, preserveDrawingBuffer: true });
  renderer.setPixelRatio(1);
  renderer.setSize(width, height);
  renderer.setClearColor(0x000000, 1);
  const scene = new THREE.Scene();
  const spark = new SparkRenderer({
    renderer,
    // The variance that every Gaussian gains in px², without a loss of opacity.
    preBlurAmount: 0.3,
    blurAmount: 0,
    // Where an opaque Gaussian falls below one step of eight bits, and what is below.
    maxStdDev: Math.sqrt(2 * Math.log(255)),
    minAlpha: 1 / 255,
    sortRadial: false,
    enableLod: false,
    autoUpdate: false,
    accumExtSplats: true,
  });
  scene.add(spark);
  const mesh = new SplatMesh({ url, ...kept });
  await mesh.initialized;
  mesh.applyMatrix4(new THREE.Matrix4().fromArray(matrix));
  scene.add(mesh);
  const camera = new THREE.PerspectiveCamera();
  camera.matrixAutoUpdate = false;
  return async (view) => {
    take(camera, view);
    scene.updateMatrixWorld();
    for (let turn = 0; ; turn += 1) {
      await spark.update({ scene, camera });
      if (!spark.sorting && !spark.sortDirty && spark.activeSplats > 0) break;
      if (turn === TURNS) throw new Error(`Spark is not done sorting: ${spark.activeSplats} Gaussians`);
      await new Promise((resolve) => { setTimeout(resolve, 10); });
    }
    renderer.render(scene, camera);
  };
}
