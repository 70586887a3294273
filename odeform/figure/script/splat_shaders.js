const BEYOND = 1.3; // half pictures from the middle, within which centres may be seen
const ROW = 2048; // texels of a row of data
// Gaussian splats: projected as by Zwicker et al. 2001, "EWA volume splatting"; colours by harmonics as of Kerbl et al. 2023.
// Each pixel of the first pass is a splat: that is less work than each corner of it, and faster than instances in software.
const SPLAT_PROJECTED = HEAD + `
precision highp int; precision highp sampler2D; precision highp isampler2D; precision highp usampler2D;
uniform mat4 view; uniform mat3 turn; uniform vec3 eye; uniform vec2 pixels, center; uniform float steps[30];
uniform int count, moving, coefficients; uniform float floorAt, reach, size;
uniform sampler2D places, shapes, colors, shares, nodes, shadow; uniform isampler2D harmonics; uniform usampler2D near;
layout(location = 0) out uvec4 place; layout(location = 1) out uvec4 across;
ivec2 at(int i) { return ivec2(i % ${ROW}, i / ${ROW}); }
void basis(vec3 d, out float b[15]) {
  float x = d.x, y = d.y, z = d.z, xx = x * x, yy = y * y, zz = z * z;
  b[0] = -0.4886025119 * y; b[1] = 0.4886025119 * z; b[2] = -0.4886025119 * x;
  b[3] = 1.0925484306 * x * y; b[4] = -1.0925484306 * y * z; b[5] = 0.3153915653 * (2.0 * zz - xx - yy);
  b[6] = -1.0925484306 * x * z; b[7] = 0.5462742153 * (xx - yy);
  b[8] = -0.5900435899 * y * (3.0 * xx - yy); b[9] = 2.8906114426 * x * y * z;
  b[10] = -0.4570457995 * y * (4.0 * zz - xx - yy); b[11] = 0.3731763326 * z * (2.0 * zz - 3.0 * xx - 3.0 * yy);
  b[12] = -0.4570457995 * x * (4.0 * zz - xx - yy); b[13] = 1.4453057213 * z * (xx - yy);
  b[14] = -0.5900435899 * x * (xx - 3.0 * yy);
}
void main() {
  int i = int(gl_FragCoord.y) * ${ROW} + int(gl_FragCoord.x);
  place = across = uvec4(0u);
  if (i >= count) return;
  vec3 splat = texelFetch(places, at(i), 0).xyz;
  vec4 clip = view * vec4(splat, 1.0);
  if (clip.w <= 0.0 || any(greaterThan(abs(clip.xy), vec2(${BEYOND} * clip.w)))) return;
  vec4 p = texelFetch(shapes, at(2 * i), 0), q = texelFetch(shapes, at(2 * i + 1), 0), rgba = texelFetch(colors, at(i), 0);
  mat3 s = mat3(p.x, p.y, p.z, p.y, p.w, q.x, p.z, q.x, q.y);
  vec3 toward = normalize(splat - eye);
  if (i < moving) {
    uvec4 n = texelFetch(near, at(i), 0);
    vec4 by = texelFetch(shares, at(i), 0), r = vec4(0.0);
    mat3 f = mat3(0.0);
    by /= by.x + by.y + by.z + by.w;
    for (int k = 0; k < 4; k++) {
      if (by[k] == 0.0) continue;
      int first = 4 * int(n[k]);
      vec4 a = texelFetch(nodes, at(first), 0), b = texelFetch(nodes, at(first + 1), 0), c = texelFetch(nodes, at(first + 2), 0);
      f += by[k] * mat3(a.xyz, b.xyz, c.xyz);
      r += by[k] * vec4(a.w, b.w, c.w, texelFetch(nodes, at(first + 3), 0).w);
    }
    f = turn * f;
    s = f * s * transpose(f);
    // the direction of view, in the splat's own axes
    r = normalize(r);
    toward = toward * turn;
    toward += 2.0 * cross(r.xyz, cross(r.xyz, toward) - r.w * toward);
  }
  // the plane of the picture, in pixels
  vec2 ndc = clip.xy / clip.w;
  mat4 rows = transpose(view);
  vec3 u = pixels.x * (rows[0].xyz - ndc.x * rows[3].xyz) / clip.w, v = pixels.y * (rows[1].xyz - ndc.y * rows[3].xyz) / clip.w;
  float a = dot(u, s * u) + 0.3, b = dot(u, s * v), c = dot(v, s * v) + 0.3;
  float middle = 0.5 * (a + c), apart = length(vec2(0.5 * (a - c), b));
  float large = middle + apart, small = max(middle - apart, 0.1);
  vec2 along = apart < 1e-6 * middle ? vec2(1.0, 0.0) : b == 0.0 ? (a >= c ? vec2(1.0, 0.0) : vec2(0.0, 1.0)) : normalize(vec2(b, large - a));
  place = floatBitsToUint(vec4(ndc, sqrt(large) * along / pixels));
  vec3 rgb = q.z + q.w * rgba.rgb;
  if (coefficients > 0) {
    float values[15];
    basis(toward, values);
    for (int h = 0; h < coefficients; h++)
      rgb += steps[i < moving ? h : 15 + h] * values[h] * vec3(texelFetch(harmonics, at(coefficients * i + h), 0).rgb);
  }
  if (i >= moving && abs(splat.z - floorAt) < 0.06 * size) {
    vec2 there = 0.5 + 0.5 * (splat.xy - center) / reach;
    if (all(lessThan(abs(there - 0.5), vec2(0.5)))) rgb *= 1.0 - 0.62 * textureLod(shadow, there, 0.0).r;
  }
  uvec4 whole = uvec4(255.0 * clamp(vec4(rgb, rgba.a), 0.0, 1.0) + 0.5);
  float wide = min(sqrt(2.0 * log(max(255.0 * rgba.a, 1.0))), 2.83);
  uint shade = whole.r | whole.g << 8 | whole.b << 16 | whole.a << 24;
  across = uvec4(floatBitsToUint(vec3(sqrt(small) * vec2(along.y, -along.x) / pixels, wide)), shade);
}`;
const SPLAT_CORNER = HEAD + `
precision highp int; precision highp usampler2D;
uniform usampler2D order, place, across; out vec2 off; flat out vec4 rgba;
void main() {
  // a triangle around the ellipse: less work than two, where splats are as small as pixels
  int i = gl_VertexID / 3, corner = gl_VertexID % 3;
  int splat = int(texelFetch(order, ivec2(i % ${ROW}, i / ${ROW}), 0).r);
  ivec2 at = ivec2(splat % ${ROW}, splat / ${ROW});
  uvec4 a = texelFetch(place, at, 0), b = texelFetch(across, at, 0);
  vec4 first = uintBitsToFloat(a);
  vec3 second = uintBitsToFloat(b.xyz);
  off = second.z * (corner == 2 ? vec2(0.0, 2.0) : vec2(corner == 0 ? -1.7320508 : 1.7320508, -1.0));
  rgba = vec4(b.w & 255u, b.w >> 8 & 255u, b.w >> 16 & 255u, b.w >> 24) / 255.0;
  gl_Position = vec4(first.xy + off.x * first.zw + off.y * second.xy, 0.0, 1.0);
}`;
const SPLAT_PIXEL = HEAD + `
in vec2 off; flat in vec4 rgba; out vec4 color;
void main() {
  float strength = rgba.a * exp(-0.5 * dot(off, off));
  color = vec4(rgba.rgb * strength, strength);
}`;

