// The GL functions that the renderer calls, taken from OSMesa at run time so that a second GL library in the
// process cannot answer in its place.
#pragma once

#define GL_GLEXT_PROTOTYPES
#include <GL/gl.h>
#include <GL/glext.h>
#include <GL/osmesa.h>

#include <stdexcept>
#include <string>

namespace selvedge::render {

// Laid out by hand: clang-format lays such a list out anew each time.
// clang-format off
#define SELVEDGE_GL_FUNCTIONS(X) \
  X(ActiveTexture) X(AttachShader) X(BindBuffer) X(BindFramebuffer) X(BindRenderbuffer) X(BindTexture) \
  X(BindVertexArray) X(BlitFramebuffer) X(BufferData) X(CheckFramebufferStatus) X(Clear) X(ClearColor) \
  X(ColorMask) X(CompileShader) X(CreateProgram) X(CreateShader) X(DeleteShader) X(Disable) X(DrawBuffer) \
  X(DrawElements) X(Enable) X(EnableVertexAttribArray) X(Finish) X(FramebufferRenderbuffer) \
  X(FramebufferTexture2D) X(GenBuffers) X(GenFramebuffers) X(GenRenderbuffers) X(GenTextures) X(GenVertexArrays) \
  X(GenerateMipmap) X(GetError) X(GetProgramInfoLog) X(GetProgramiv) X(GetShaderInfoLog) X(GetShaderiv) \
  X(GetUniformLocation) X(LinkProgram) X(PixelStorei) X(ReadBuffer) X(ReadPixels) \
  X(RenderbufferStorageMultisample) X(ShaderSource) X(TexImage1D) X(TexImage2D) X(TexParameteri) X(Uniform1f) \
  X(Uniform1i) X(Uniform2f) X(Uniform3f) X(Uniform4f) X(UseProgram) X(VertexAttribPointer) X(Viewport)
// clang-format on

struct Gl {
#define SELVEDGE_GL_MEMBER(name) decltype(&::gl##name) name = nullptr;
  SELVEDGE_GL_FUNCTIONS(SELVEDGE_GL_MEMBER)
#undef SELVEDGE_GL_MEMBER

  // With a context current.
  void load() {
#define SELVEDGE_GL_LOAD(name)                                                      \
  name = reinterpret_cast<decltype(&::gl##name)>(OSMesaGetProcAddress("gl" #name)); \
  if (name == nullptr) throw std::runtime_error("OSMesa: no function gl" #name);
    SELVEDGE_GL_FUNCTIONS(SELVEDGE_GL_LOAD)
#undef SELVEDGE_GL_LOAD
  }
};

}  // namespace selvedge::render
