// Numbers of files of points (points_file.h): one after another, as text or as bytes.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace selvedge::station {

struct NumberType {
  char kind = 'f';  // f: a float, i, u: whole, with and without a sign
  size_t bytes = 4;
  bool is_big = false;  // its first byte counts most
};

// Whether numbers of that type are known.
bool is_known(const NumberType& type);

// Reads a file from its beginning. Throws BadInput naming it where it ends early.
class PointBytes {
 public:
  PointBytes(std::string_view bytes, std::string where) : bytes_(bytes), where_(std::move(where)) {}

  const std::string& where() const { return where_; }
  size_t left() const { return bytes_.size() - at_; }
  // Without its end, a carriage return before that included.
  std::string line();
  std::string_view take(size_t count);
  double number(const NumberType& type);
  // The next word between white space as a number; "nan" too.
  double word();

 private:
  std::string_view bytes_;
  std::string where_;
  size_t at_ = 0;
};

double number_at(const char* bytes, const NumberType& type);
std::vector<std::string> words_of(const std::string& line);
// Which of x, y and z a number named so is; 3: none.
size_t axis_of(const std::string& name);
// A whole number of a header, from `least` to 100 million. Throws BadInput naming `where` and `what` otherwise.
size_t count_of(const std::string& word, size_t least, const std::string& where, const std::string& what);

}  // namespace selvedge::station
