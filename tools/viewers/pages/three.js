// three.js' own add-ons: WebGPURenderer on WebGL 2, and its loaders of splat files.

import * as THREE from 'three/webgpu';
import { GaussianSplat } from 'three/addons/objects/GaussianSplat.js';
import { take } from './camera.js';

const LOADERS = {
  ply: ['GaussianSplatPLYLoader', 'three/addons/loaders/GaussianSplatPLYLoader.js'],
  spz: ['SPZLoader', 'three/addons/loaders/SPZLoader.js'],
  splat: ['SPLATLoader', 'three/addons/loaders/SPLATLoader.js'],
};

async function load(url) {
  const extension = url.split('.').pop();
  if (extension === 'glb') {
    const { GLTFLoader } = await import('three/addons/loaders/GLTFLoader.js');
    const { GLTFGaussianSplatLoaderExtension } = await import('three/addons/loaders/GLTFGaussianSplatLoaderExtension.js');
    const loader = new GLTFLoader();
    loader.register((parser) => new GLTFGaussianSplatLoaderExtension(parser));
    return (await loader.loadAsync(url)).scene;
  }
  if (!LOADERS[extension]) throw new Error(`three.js has no loader of .${extension}`);
  const [name, module] = LOADERS[extension];
  const Loader = (await import(module))[name];
  return new GaussianSplat(await new Loader().loadAsync(url));
}

export async function open(canvas, url, [width, height], matrix) {
  const renderer = new THREE.WebGPURenderer({ canvas, antialias: false, forceWebGL: true });
  // Splat files hold what is shown, not light.
  renderer.outputColorSpace = THREE.LinearSRGBColorSpace;
  await renderer.init();
  renderer.setPixelRatio(1);
  renderer.setSize(width, height);
  renderer.setClearColor(0x000000, 1);
  const scene = new THREE.Scene();
  const splats = await load(url);
  const root = new THREE.Group();
  root.applyMatrix4(new THREE.Matrix4().fromArray(matrix));
  root.add(splats);
  scene.add(root);
  const camera = new THREE.PerspectiveCamera();
  camera.matrixAutoUpdate = false;
  return async (view) => {
    take(camera, view);
    // Twice: pipelines are made while the first is drawn.
    for (let turn = 0; turn < 2; turn += 1) {
      await renderer.renderAsync(scene, camera);
      await new Promise(requestAnimationFrame);
    }
  };
}
