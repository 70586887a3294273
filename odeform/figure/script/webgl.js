// whether there is no graphics card: smooth edges then cost more than all else
function drawnInSoftware() {
  const probe = document.createElement("canvas").getContext("webgl2");
  const told = probe?.getParameter(probe.RENDERER) ?? "";
  // Chromium tells it by an extension only, of which Firefox warns
  const info = told.startsWith("WebKit") && probe.getExtension("WEBGL_debug_renderer_info");
  const name = info ? probe.getParameter(info.UNMASKED_RENDERER_WEBGL) : told;
  return /swiftshader|llvmpipe|softpipe|software|basic render/i.test(name);
}

const canvas = $("canvas");
const gl = canvas.getContext("webgl2", { antialias: !drawnInSoftware(), alpha: false });
const SHADOW = 128; // pixels of a shadow, each way

const ATTRIBUTES = ["point", "normal", "corner", "rest", "own"];

// sets uniforms by name when it is called, and is in use from then on
function program(vertex, pixel) {
  const made = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, pixel]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(made, shader);
  }
  ATTRIBUTES.forEach((name, i) => gl.bindAttribLocation(made, i, name));
  gl.linkProgram(made);
  if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(made, gl.ACTIVE_UNIFORMS); i++) {
    const { name, type } = gl.getActiveUniform(made, i);
    uniforms[name.replace("[0]", "")] = [gl.getUniformLocation(made, name), SETTERS[type] ?? "1i"];
  }
  return (values) => {
    gl.useProgram(made);
    for (const [name, value] of Object.entries(values)) {
      const [at, setter] = uniforms[name] ?? [];
      if (!at) continue;
      if (setter.startsWith("Matrix")) gl[`uniform${setter}`](at, setter === "Matrix3fv", value); // by rows
      else gl[`uniform${setter}`](at, setter === "1fv" && typeof value === "number" ? [value] : value);
    }
  };
}

const SETTERS = {
  [gl?.FLOAT]: "1fv", [gl?.FLOAT_VEC2]: "2fv", [gl?.FLOAT_VEC3]: "3fv", [gl?.FLOAT_MAT3]: "Matrix3fv", [gl?.FLOAT_MAT4]: "Matrix4fv",
};

// an attribute of the buffer that is bound
function attribute(name, size, kind = gl.FLOAT) {
  const at = ATTRIBUTES.indexOf(name);
  gl.enableVertexAttribArray(at);
  gl.vertexAttribPointer(at, size, kind, kind !== gl.FLOAT, 0, 0);
}

function unused(name) {
  gl.disableVertexAttribArray(ATTRIBUTES.indexOf(name));
}

function target() {
  const texture = gl.createTexture(), frame = gl.createFramebuffer();
  gl.bindTexture(gl.TEXTURE_2D, texture);
  gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA8, SHADOW, SHADOW, 0, gl.RGBA, gl.UNSIGNED_BYTE, null);
  for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(gl.TEXTURE_2D, side, gl.CLAMP_TO_EDGE);
  for (const filter of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, filter, gl.LINEAR);
  gl.bindFramebuffer(gl.FRAMEBUFFER, frame);
  gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
  return { texture, frame };
}

function buffer(data, kind = gl.ARRAY_BUFFER, use = gl.STATIC_DRAW) {
  const made = gl.createBuffer();
  gl.bindBuffer(kind, made);
  gl.bufferData(kind, data, use);
  return made;
}

