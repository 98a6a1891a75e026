// Simulators for the shell that say the right thing first and then break the protocol in one way each.
#pragma once

#include <string>

namespace selvedge::station {

// parameters: JSON list.
inline std::string hello_words(const std::string& more = "") {
  return R"({"protocol":"simulator/1","name":"broken","holds":["corners"],"parameters":[{"name":"k","default":1,)"
         R"("lower":0.1,"upper":10,"log":true}])" +
         more + "}";
}

// What a shell does after saying that, once it was told a trial and a run; `$$` is its process.
inline std::string shell_simulator(const std::string& then, const std::string& hello = hello_words()) {
  return "echo '" + hello + "'; read trial; read run; " + then;
}

}  // namespace selvedge::station
