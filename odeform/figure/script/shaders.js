const HEAD = "#version 300 es\nprecision highp float;\n";
const BODY_VERTEX = HEAD + `
in vec3 point; in vec3 normal; in vec3 rest; in vec3 own; uniform mat4 view; out vec3 n; out vec3 p; out vec3 inside; out vec3 paint;
void main() { n = normal; p = point; inside = rest; paint = own; gl_Position = view * vec4(point, 1.0); }`;
const BODY_PIXEL = HEAD + `
in vec3 n; in vec3 p; in vec3 inside; in vec3 paint; uniform vec3 eye, light, clay, sky, ground, origin;
uniform float floorAt, size, cube, painted; out vec4 color;
float dark() {
  // 1 in every second cube, with edges as wide as a pixel
  vec3 at = (inside - origin) / cube, wave = sin(3.14159265 * at);
  wave = clamp(wave / max(3.14159265 * fwidth(at), 1e-4), -1.0, 1.0);
  return 0.5 - 0.5 * wave.x * wave.y * wave.z;
}
void main() {
  vec3 normal = normalize(n), to = normalize(eye - p);
  if (!gl_FrontFacing) normal = -normal;
  float key = clamp((dot(normal, light) + 0.35) / 1.35, 0.0, 1.0);
  vec3 fill = mix(ground, sky, 0.5 + 0.5 * normal.z);
  float near = 1.0 - 0.45 * exp(-5.0 * max(p.z - floorAt, 0.0) / size) * clamp(0.6 - normal.z, 0.0, 1.0);
  float rim = pow(1.0 - max(dot(normal, to), 0.0), 3.0) * clamp(0.5 + 0.5 * normal.z, 0.0, 1.0);
  vec3 matter = painted > 0.0 ? paint : clay * (1.0 - 0.16 * dark());
  vec3 lit = pow(matter, vec3(2.2)) * (0.85 * key * key + 0.5 * fill * near) + 0.05 * rim * sky;
  lit += 0.035 * pow(max(dot(normal, normalize(light + to)), 0.0), 20.0);
  color = vec4(pow(lit, vec3(1.0 / 2.2)), 1.0);
}`;
const SHADOW_VERTEX = HEAD + `
in vec3 point; uniform vec3 light; uniform vec2 about; uniform float floorAt, reach, wide; out float strength;
void main() {
  float above = max(point.z - floorAt, 0.0);
  vec2 at = point.xy - light.xy / light.z * above;
  strength = exp(-1.3 * above / reach);
  gl_Position = vec4((at - about) / reach, 0.0, 1.0);
  gl_PointSize = wide;
}`;
const SHADOW_PIXEL = HEAD + `in float strength; out vec4 color; void main() { color = vec4(strength); }`;
const WHOLE_VERTEX = HEAD + `
in vec2 corner; out vec2 at; void main() { at = 0.5 + 0.5 * corner; gl_Position = vec4(corner, 0.0, 1.0); }`;
const BLUR_PIXEL = HEAD + `
in vec2 at; uniform sampler2D image; uniform vec2 along; out vec4 color;
void main() {
  float sum = 0.0, total = 0.0;
  for (int i = -4; i <= 4; i++) {
    float w = exp(-float(i * i) / 8.0);
    sum += w * texture(image, at + float(i) * along).r;
    total += w;
  }
  color = vec4(sum / total);
}`;
const FLOOR_VERTEX = HEAD + `
in vec2 corner; uniform mat4 view; uniform vec2 about; uniform float floorAt, far; out vec2 p;
void main() { p = about + far * corner; gl_Position = view * vec4(p, floorAt, 1.0); }`;
const FLOOR_PIXEL = HEAD + `
in vec2 p; uniform sampler2D shadow; uniform vec2 about, center; uniform vec3 paper, line, shade;
uniform float reach, far, cell; out vec4 color;
float lines(vec2 at) {
  vec2 wide = max(fwidth(at), 1e-6), off = abs(fract(at - 0.5) - 0.5) / wide;
  return (1.0 - clamp(min(off.x, off.y), 0.0, 1.0)) * clamp(1.5 - 3.0 * max(wide.x, wide.y), 0.0, 1.0);
}
void main() {
  float fade = clamp(1.0 - length(p - about) / far, 0.0, 1.0);
  float grid = max(0.45 * lines(p / cell), lines(p / cell / 5.0)) * fade;
  vec2 at = 0.5 + 0.5 * (p - center) / reach;
  float dark = all(lessThan(abs(at - 0.5), vec2(0.5))) ? texture(shadow, at).r : 0.0;
  color = vec4(mix(mix(paper, line, grid), shade, 0.62 * dark), 1.0);
}`;

