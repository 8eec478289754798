// Does again what a device was asked to do, by WebGPU in headless Chromium on SwiftShader.
//
//   node webgpu.mjs FOLDER
//
// FOLDER/tape.json: what to do, step by step (src/gpu/tape.rs), the limits that the device must
// be made with, and every kernel by name; FOLDER/tape.bin: what is written into buffers. Writes
// FOLDER/answers.bin, what the reads gave, one after the other. Prints a line of JSON: the
// adapter, how many entry points were compiled, and the seconds that this and all took. Status 1 where anything went wrong.
import { createReadStream, createWriteStream } from "node:fs";
import { createServer } from "node:http";
import { join } from "node:path";
import { pipeline } from "node:stream/promises";
import { launch } from "./browser.mjs";

const WEBGPU = [
  "--enable-unsafe-webgpu", "--use-webgpu-adapter=swiftshader", "--enable-features=Vulkan", "--use-vulkan=swiftshader",
  "--use-angle=swiftshader",
];

const [folder] = process.argv.slice(2);
const server = createServer(async (request, response) => {
  if (request.method === "POST") {
    await pipeline(request, createWriteStream(join(folder, "answers.bin")));
    response.end();
  } else if (["/tape.json", "/tape.bin"].includes(request.url)) {
    await pipeline(createReadStream(join(folder, request.url)), response);
  } else {
    response.setHeader("content-type", "text/html");
    response.end("<title>WebGPU</title>");
  }
});
await new Promise((resolve) => server.listen(0, "127.0.0.1", resolve));

// In the page.
async function play() {
  const { limits, kernels, steps } = await (await fetch("/tape.json")).json();
  const bytes = new Uint8Array(await (await fetch("/tape.bin")).arrayBuffer());
  const adapter = await navigator.gpu?.requestAdapter();
  if (!adapter) throw new Error("no WebGPU adapter");
  const device = await adapter.requestDevice({ requiredLimits: limits });
  const errors = [];
  device.addEventListener("uncapturederror", ({ error }) => errors.push(error.message));

  // Modules by their source, pipelines by source, entry point and constants.
  const modules = new Map();
  const pipelines = new Map();
  const module = (code) => {
    if (!modules.has(code)) modules.set(code, device.createShaderModule({ code }));
    return modules.get(code);
  };
  const compile = (code, entryPoint, constants) => {
    const key = JSON.stringify([code, entryPoint, constants]);
    if (!pipelines.has(key)) {
      const compute = { module: module(code), entryPoint, constants };
      pipelines.set(key, device.createComputePipelineAsync({ layout: "auto", compute }));
    }
    return pipelines.get(key);
  };
  // All at once, so that they are compiled beside each other: what is asked for, then every
  // other entry point.
  const begun = performance.now();
  const asked = steps.filter((step) => step.do === "kernel");
  const compiling = asked.map(({ name, source, constants }) => compile(source, name, Object.fromEntries(constants)));
  const used = new Set(asked.map(({ name, source }) => JSON.stringify([name, source])));
  for (const [, code] of kernels) {
    for (const [, name] of code.matchAll(/@compute[^{]*?\bfn (\w+)/g)) {
      if (!used.has(JSON.stringify([name, code]))) compile(code, name, {});
    }
  }
  const compiled = await Promise.all(compiling);
  await Promise.all(pipelines.values());
  for (const made of modules.values()) {
    const { messages } = await made.getCompilationInfo();
    errors.push(...messages.map(({ type, message }) => `${type}: ${message}`));
  }
  const seconds = { compiling: (performance.now() - begun) / 1000 };

  const { STORAGE, INDIRECT, UNIFORM, COPY_SRC, COPY_DST, MAP_READ } = GPUBufferUsage;
  const buffers = [];
  const answers = [];
  const groups = new Map();
  let encoder = device.createCommandEncoder();
  let pass = null;
  const endPass = () => {
    pass?.end();
    pass = null;
  };
  const submit = () => {
    endPass();
    device.queue.submit([encoder.finish()]);
    encoder = device.createCommandEncoder();
  };
  for (const step of steps) {
    switch (step.do) {
      case "buffer": {
        const usage = (step.uniform ? UNIFORM : STORAGE | INDIRECT) | COPY_SRC | COPY_DST;
        buffers.push(device.createBuffer({ size: step.size, usage }));
        break;
      }
      case "write":
        // Before what is submitted next, after what was recorded before.
        submit();
        device.queue.writeBuffer(buffers[step.buffer], step.offset, bytes, step.at, step.size);
        break;
      case "kernel":
        break;
      case "dispatch":
      case "dispatch_indirect": {
        pass ??= encoder.beginComputePass();
        const kernel = compiled[step.kernel];
        const key = `${step.kernel}:${step.bindings}`;
        if (!groups.has(key)) {
          const layout = kernel.getBindGroupLayout(0);
          const entries = step.bindings.map(([binding, k]) => ({ binding, resource: { buffer: buffers[k] } }));
          groups.set(key, device.createBindGroup({ layout, entries }));
        }
        pass.setPipeline(kernel);
        pass.setBindGroup(0, groups.get(key));
        if (step.groups) pass.dispatchWorkgroups(...step.groups);
        else pass.dispatchWorkgroupsIndirect(buffers[step.counts], step.offset);
        break;
      }
      case "copy":
        endPass();
        encoder.copyBufferToBuffer(buffers[step.from], 0, buffers[step.to], 0, step.size);
        break;
      case "clear":
        endPass();
        encoder.clearBuffer(buffers[step.buffer]);
        break;
      case "read": {
        const staging = device.createBuffer({ size: step.size, usage: COPY_DST | MAP_READ });
        endPass();
        encoder.copyBufferToBuffer(buffers[step.buffer], 0, staging, 0, step.size);
        submit();
        await staging.mapAsync(GPUMapMode.READ);
        answers.push(staging.getMappedRange().slice());
        staging.destroy();
        break;
      }
      default:
        throw new Error(`no step is called ${step.do}`);
    }
  }
  seconds.all = (performance.now() - begun) / 1000;
  await fetch("/answers", { method: "POST", body: new Blob(answers) });
  return { adapter: `${adapter.info.vendor} ${adapter.info.architecture}`, compiled: pipelines.size, seconds, errors };
}

const browser = await launch(WEBGPU);
try {
  const page = await browser.newPage();
  page.setDefaultTimeout(0);
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  const { errors, ...about } = await page.evaluate(play);
  console.log(JSON.stringify(about));
  for (const error of errors) console.error(error);
  process.exitCode = errors.length > 0 ? 1 : 0;
} catch (error) {
  console.error(String(error));
  process.exitCode = 1;
} finally {
  await browser.close();
  server.close();
}
