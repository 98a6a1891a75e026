#include "render/stripe_renderer.h"

#include <cmath>
#include <mutex>

#include <Eigen/Geometry>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

#include "render/fast_projection.h"
#include "render/gl_functions.h"
#include "render/shaders.h"

namespace selvedge::render {

namespace {

constexpr int kFloatsPerVertex = 12;  // camera, projector, position, normal: 3 each
constexpr int kSamples = 4;
constexpr int kTexelsPerMirror = 8;

geometry::Projection facing_forward(geometry::Projection projection) {
  if (projection.matrix.leftCols<3>().determinant() < 0) projection.matrix *= -1;
  return projection;
}

struct DepthScale {
  float a, b;
};

// Clip depth of the range of w that the vertices span, with a margin.
DepthScale depth_scale(double nearest, double farthest) {
  const double n = std::max(1e-3, 0.9 * nearest), f = std::max(1.1 * farthest, n * 1.01);
  return {float((f + n) / (f - n)), float(-2 * n * f / (f - n))};
}

}  // namespace

struct StripeRenderer::Impl {
  geometry::Projection camera, projector;
  RenderOptions options;
  bool horizontal = true;
  FastProjection to_camera, to_projector;
  Eigen::Vector3d eye, lamp;
  OSMesaContext context = nullptr;
  std::vector<unsigned char> surface;  // OSMesa wants a buffer of its own; all drawing goes to textures
  Gl gl;
  GLuint camera_program = 0, depth_program = 0, vertex_array = 0, vertex_buffer = 0, index_buffer = 0;
  GLuint camera_target = 0, camera_resolved = 0, shadow_target = 0, shadow_map = 0, profile = 0;
  std::vector<float> vertices;

  Impl(const geometry::Projection& camera_in, const geometry::Projection& projector_in, const RenderOptions& options_in)
      : camera(facing_forward(camera_in)), projector(facing_forward(projector_in)), options(options_in),
        to_camera(camera), to_projector(projector), eye(geometry::centre(camera)), lamp(geometry::centre(projector)) {
    create_context();
    Current current(*this);
    gl.load();
    camera_program = link(kCameraVertexShader, kCameraFragmentShader);
    depth_program = link(kDepthVertexShader, kDepthFragmentShader);
    create_buffers();
    create_targets();
    upload_profile(std::vector<float>(projector.height_px, 1.0f));
  }
  ~Impl() { OSMesaDestroyContext(context); }

  // Makes the context current for a scope. Creation and switching share state inside Mesa.
  struct Current {
    explicit Current(Impl& impl) {
      if (!OSMesaMakeCurrent(impl.context, impl.surface.data(), GL_UNSIGNED_BYTE, 4, 4))
        throw std::runtime_error("OSMesa: the context cannot be made current");
    }
    ~Current() { OSMesaMakeCurrent(nullptr, nullptr, GL_UNSIGNED_BYTE, 0, 0); }
  };

  void create_context();
  void create_buffers();
  void create_targets();
  GLuint link(const char* vertex_source, const char* fragment_source);
  GLuint compile(GLenum kind, const char* source);
  void upload_profile(const std::vector<float>& brightness);
  void upload_mesh(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles);
  DepthScale scale_of(int first_float) const;
  void draw_shadow_map(int index_count, DepthScale scale);
  void draw_camera(int index_count, DepthScale camera_scale, DepthScale shadow_scale);
  Image read_back();
  GLint uniform(GLuint program, const char* name) { return gl.GetUniformLocation(program, name); }
};

void StripeRenderer::Impl::create_context() {
  const int attributes[] = {OSMESA_FORMAT,
                            OSMESA_RGBA,
                            OSMESA_DEPTH_BITS,
                            24,
                            OSMESA_PROFILE,
                            OSMESA_CORE_PROFILE,
                            OSMESA_CONTEXT_MAJOR_VERSION,
                            3,
                            OSMESA_CONTEXT_MINOR_VERSION,
                            3,
                            0};
  static std::mutex creation;  // Mesa builds its screen on the first context
  const std::lock_guard lock(creation);
  context = OSMesaCreateContextAttribs(attributes, nullptr);
  if (context == nullptr) throw std::runtime_error("OSMesa gives no OpenGL 3.3 core context");
  surface.assign(4 * 4 * 4, 0);
}

GLuint StripeRenderer::Impl::compile(GLenum kind, const char* source) {
  const GLuint shader = gl.CreateShader(kind);
  gl.ShaderSource(shader, 1, &source, nullptr);
  gl.CompileShader(shader);
  GLint good = 0;
  gl.GetShaderiv(shader, GL_COMPILE_STATUS, &good);
  if (!good) {
    char log[2048] = "";
    gl.GetShaderInfoLog(shader, sizeof log, nullptr, log);
    throw std::runtime_error(std::string("shader: ") + log);
  }
  return shader;
}

GLuint StripeRenderer::Impl::link(const char* vertex_source, const char* fragment_source) {
  const GLuint vertex = compile(GL_VERTEX_SHADER, vertex_source);
  const GLuint fragment = compile(GL_FRAGMENT_SHADER, fragment_source);
  const GLuint program = gl.CreateProgram();
  gl.AttachShader(program, vertex);
  gl.AttachShader(program, fragment);
  gl.LinkProgram(program);
  GLint good = 0;
  gl.GetProgramiv(program, GL_LINK_STATUS, &good);
  if (!good) {
    char log[2048] = "";
    gl.GetProgramInfoLog(program, sizeof log, nullptr, log);
    throw std::runtime_error(std::string("shader program: ") + log);
  }
  gl.DeleteShader(vertex);
  gl.DeleteShader(fragment);
  return program;
}

void StripeRenderer::Impl::create_buffers() {
  gl.GenVertexArrays(1, &vertex_array);
  gl.BindVertexArray(vertex_array);
  gl.GenBuffers(1, &vertex_buffer);
  gl.GenBuffers(1, &index_buffer);
  gl.BindBuffer(GL_ARRAY_BUFFER, vertex_buffer);
  gl.BindBuffer(GL_ELEMENT_ARRAY_BUFFER, index_buffer);
  for (int i = 0; i < kFloatsPerVertex / 3; ++i) {
    gl.EnableVertexAttribArray(i);
    gl.VertexAttribPointer(i, 3, GL_FLOAT, GL_FALSE, kFloatsPerVertex * sizeof(float),
                           reinterpret_cast<const void*>(3 * i * sizeof(float)));
  }
}

void StripeRenderer::Impl::create_targets() {
  const int width = camera.width_px, height = camera.height_px;
  GLuint buffers[3];
  gl.GenRenderbuffers(3, buffers);
  gl.BindRenderbuffer(GL_RENDERBUFFER, buffers[0]);
  gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, GL_R8, width, height);
  gl.BindRenderbuffer(GL_RENDERBUFFER, buffers[1]);
  gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, kSamples, GL_DEPTH_COMPONENT24, width, height);
  gl.BindRenderbuffer(GL_RENDERBUFFER, buffers[2]);
  gl.RenderbufferStorageMultisample(GL_RENDERBUFFER, 0, GL_R8, width, height);

  gl.GenFramebuffers(1, &camera_target);
  gl.BindFramebuffer(GL_FRAMEBUFFER, camera_target);
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers[0]);
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_RENDERBUFFER, buffers[1]);
  const bool camera_good = gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;

  gl.GenFramebuffers(1, &camera_resolved);
  gl.BindFramebuffer(GL_FRAMEBUFFER, camera_resolved);
  gl.FramebufferRenderbuffer(GL_FRAMEBUFFER, GL_COLOR_ATTACHMENT0, GL_RENDERBUFFER, buffers[2]);
  const bool resolved_good = gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;

  gl.GenTextures(1, &shadow_map);
  gl.BindTexture(GL_TEXTURE_2D, shadow_map);
  gl.TexImage2D(GL_TEXTURE_2D, 0, GL_DEPTH_COMPONENT24, projector.width_px, projector.height_px, 0, GL_DEPTH_COMPONENT,
                GL_UNSIGNED_INT, nullptr);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MIN_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  gl.TexParameteri(GL_TEXTURE_2D, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
  gl.GenFramebuffers(1, &shadow_target);
  gl.BindFramebuffer(GL_FRAMEBUFFER, shadow_target);
  gl.FramebufferTexture2D(GL_FRAMEBUFFER, GL_DEPTH_ATTACHMENT, GL_TEXTURE_2D, shadow_map, 0);
  gl.DrawBuffer(GL_NONE);
  gl.ReadBuffer(GL_NONE);
  const bool shadow_good = gl.CheckFramebufferStatus(GL_FRAMEBUFFER) == GL_FRAMEBUFFER_COMPLETE;
  if (!camera_good || !resolved_good || !shadow_good)
    throw std::runtime_error("OSMesa: a frame buffer of " + std::to_string(width) + " x " + std::to_string(height) +
                             " pixels is refused");
}

void StripeRenderer::Impl::upload_profile(const std::vector<float>& brightness) {
  cv::Mat line(1, int(brightness.size()) * kTexelsPerMirror, CV_32F);
  for (int i = 0; i < line.cols; ++i) line.at<float>(i) = brightness[i / kTexelsPerMirror];
  if (options.projector_blur_px > 0)
    cv::GaussianBlur(line, line, {}, options.projector_blur_px * kTexelsPerMirror, 1e-6, cv::BORDER_REPLICATE);
  if (profile == 0) gl.GenTextures(1, &profile);
  gl.BindTexture(GL_TEXTURE_1D, profile);
  gl.PixelStorei(GL_UNPACK_ALIGNMENT, 1);
  gl.TexImage1D(GL_TEXTURE_1D, 0, GL_R32F, line.cols, 0, GL_RED, GL_FLOAT, line.data);
  gl.TexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MIN_FILTER, GL_LINEAR_MIPMAP_LINEAR);
  gl.TexParameteri(GL_TEXTURE_1D, GL_TEXTURE_MAG_FILTER, GL_LINEAR);
  gl.TexParameteri(GL_TEXTURE_1D, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.GenerateMipmap(GL_TEXTURE_1D);
}

void StripeRenderer::Impl::upload_mesh(const Eigen::Matrix3Xd& position,
                                       const std::vector<std::array<int, 3>>& triangles) {
  const Eigen::Matrix3Xd normals = vertex_normals(position, triangles);
  vertices.assign(size_t(position.cols()) * kFloatsPerVertex, 0.0f);
  for (Eigen::Index i = 0; i < position.cols(); ++i) {
    Eigen::Map<Eigen::Matrix<float, kFloatsPerVertex, 1>> vertex(vertices.data() + i * kFloatsPerVertex);
    vertex.segment<3>(0) = to_camera(position.col(i)).cast<float>();
    vertex.segment<3>(3) = to_projector(position.col(i)).cast<float>();
    vertex.segment<3>(6) = position.col(i).cast<float>();
    vertex.segment<3>(9) = normals.col(i).cast<float>();
  }
  gl.BufferData(GL_ARRAY_BUFFER, vertices.size() * sizeof(float), vertices.data(), GL_STREAM_DRAW);
  gl.BufferData(GL_ELEMENT_ARRAY_BUFFER, triangles.size() * sizeof(triangles[0]), triangles.data(), GL_STREAM_DRAW);
}

DepthScale StripeRenderer::Impl::scale_of(int first_float) const {
  double nearest = 1e30, farthest = 0;
  for (size_t i = first_float; i < vertices.size(); i += kFloatsPerVertex) {
    nearest = std::min(nearest, double(vertices[i]));
    farthest = std::max(farthest, double(vertices[i]));
  }
  return depth_scale(nearest, farthest);
}

void StripeRenderer::Impl::draw_shadow_map(int index_count, DepthScale scale) {
  gl.BindFramebuffer(GL_FRAMEBUFFER, shadow_target);
  gl.Viewport(0, 0, projector.width_px, projector.height_px);
  gl.Clear(GL_DEPTH_BUFFER_BIT);
  gl.UseProgram(depth_program);
  gl.Uniform2f(uniform(depth_program, "size"), projector.width_px, projector.height_px);
  gl.Uniform2f(uniform(depth_program, "depth_scale"), scale.a, scale.b);
  gl.DrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr);
}

void StripeRenderer::Impl::draw_camera(int index_count, DepthScale camera_scale, DepthScale shadow_scale) {
  gl.BindFramebuffer(GL_FRAMEBUFFER, camera_target);
  gl.Viewport(0, 0, camera.width_px, camera.height_px);
  gl.ClearColor(float(options.background_grey / 255), 0, 0, 1);
  gl.Clear(GL_COLOR_BUFFER_BIT | GL_DEPTH_BUFFER_BIT);
  const GLuint p = camera_program;
  gl.UseProgram(p);
  gl.Uniform2f(uniform(p, "size"), camera.width_px, camera.height_px);
  gl.Uniform2f(uniform(p, "depth_scale"), camera_scale.a, camera_scale.b);
  gl.Uniform1f(uniform(p, "horizontal"), horizontal ? 1 : 0);
  gl.Uniform2f(uniform(p, "projector_size"), projector.width_px, projector.height_px);
  gl.Uniform2f(uniform(p, "shadow_depth_scale"), shadow_scale.a, shadow_scale.b);
  gl.Uniform1f(uniform(p, "shadow_bias"), float(options.shadow_bias_m * projector.matrix.row(2).head<3>().norm()));
  gl.Uniform2f(uniform(p, "grey"), float(options.ambient_grey / 255), float(options.lit_grey / 255));
  gl.Uniform3f(uniform(p, "eye"), float(eye.x()), float(eye.y()), float(eye.z()));
  gl.Uniform3f(uniform(p, "lamp"), float(lamp.x()), float(lamp.y()), float(lamp.z()));
  gl.Uniform1i(uniform(p, "shadow_map"), 0);
  gl.Uniform1i(uniform(p, "profile"), 1);
  gl.ActiveTexture(GL_TEXTURE0 + 1);
  gl.BindTexture(GL_TEXTURE_1D, profile);
  gl.ActiveTexture(GL_TEXTURE0);
  gl.BindTexture(GL_TEXTURE_2D, shadow_map);
  gl.DrawElements(GL_TRIANGLES, index_count, GL_UNSIGNED_INT, nullptr);
}

Image StripeRenderer::Impl::read_back() {
  const int width = camera.width_px, height = camera.height_px;
  gl.BindFramebuffer(GL_READ_FRAMEBUFFER, camera_target);
  gl.BindFramebuffer(GL_DRAW_FRAMEBUFFER, camera_resolved);
  gl.BlitFramebuffer(0, 0, width, height, 0, 0, width, height, GL_COLOR_BUFFER_BIT, GL_NEAREST);
  gl.BindFramebuffer(GL_READ_FRAMEBUFFER, camera_resolved);
  gl.PixelStorei(GL_PACK_ALIGNMENT, 1);
  Image image(height, width);
  // Clip space was laid out with row 0 at the bottom, so GL's first row is the picture's first.
  gl.ReadPixels(0, 0, width, height, GL_RED, GL_UNSIGNED_BYTE, image.data());
  if (const GLenum error = gl.GetError(); error != GL_NO_ERROR)
    throw std::runtime_error("OSMesa: GL error " + std::to_string(error));
  return image;
}

StripeRenderer::StripeRenderer(const geometry::Projection& camera, const geometry::Projection& projector,
                               const RenderOptions& options)
    : impl_(std::make_unique<Impl>(camera, projector, options)) {}
StripeRenderer::~StripeRenderer() = default;
StripeRenderer::StripeRenderer(StripeRenderer&&) noexcept = default;
StripeRenderer& StripeRenderer::operator=(StripeRenderer&&) noexcept = default;

void StripeRenderer::set_pattern(const StripePattern& pattern) {
  const int mirrors = pattern.horizontal ? impl_->projector.height_px : impl_->projector.width_px;
  std::vector<float> shown(mirrors);
  for (int i = 0; i < mirrors; ++i) shown[i] = float(brightness(pattern, i));
  set_profile(pattern.horizontal, shown);
}

void StripeRenderer::set_profile(bool horizontal, const std::vector<float>& brightness) {
  const int mirrors = horizontal ? impl_->projector.height_px : impl_->projector.width_px;
  if (int(brightness.size()) != mirrors)
    throw std::invalid_argument("set_profile: " + std::to_string(brightness.size()) + " values for " +
                                std::to_string(mirrors) + " mirrors");
  Impl::Current current(*impl_);
  impl_->horizontal = horizontal;
  impl_->upload_profile(brightness);
}

Image StripeRenderer::render(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles) {
  Impl::Current current(*impl_);
  Gl& gl = impl_->gl;
  gl.Enable(GL_DEPTH_TEST);
  impl_->upload_mesh(position, triangles);
  const DepthScale camera_scale = impl_->scale_of(2), shadow_scale = impl_->scale_of(5);
  const int index_count = int(triangles.size()) * 3;
  impl_->draw_shadow_map(index_count, shadow_scale);
  impl_->draw_camera(index_count, camera_scale, shadow_scale);
  Image image = impl_->read_back();
  if (impl_->options.camera_blur_px > 0) {
    cv::Mat view(int(image.rows()), int(image.cols()), CV_8U, image.data());
    cv::GaussianBlur(view, view, {}, impl_->options.camera_blur_px);
  }
  return image;
}

Eigen::Matrix3Xd vertex_normals(const Eigen::Matrix3Xd& position, const std::vector<std::array<int, 3>>& triangles) {
  Eigen::Matrix3Xd normals = Eigen::Matrix3Xd::Zero(3, position.cols());
  for (const auto& [a, b, c] : triangles) {
    const Eigen::Vector3d area = (position.col(b) - position.col(a)).cross(position.col(c) - position.col(a));
    normals.col(a) += area;
    normals.col(b) += area;
    normals.col(c) += area;
  }
  normals.colwise().normalize();
  return normals;
}

}  // namespace selvedge::render
