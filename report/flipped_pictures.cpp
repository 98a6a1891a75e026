#include "report/flipped_pictures.h"

#include <fmt/format.h>

#include "report/base64.h"
#include "report/scripts.h"
#include "report/html.h"

namespace selvedge::report {

namespace {

constexpr const char* kPairStyle = R"(<style>
.flipped .controls { display: none; flex-wrap: wrap; gap: 6px 14px; align-items: center; margin: .5em 0; }
.flipped .pair { display: flex; gap: 10px; margin-bottom: 10px; }
.flipped .pair > div { flex: 1 1 0; }
.flipped img { display: block; width: 100%; image-rendering: pixelated; }
@media screen {
  .flipped.runs .controls { display: flex; }
  .flipped.runs .frame { overflow: auto; max-height: 85vh; }
  .flipped.runs .pair { display: block; position: relative; margin: 0; }
  .flipped.runs .pair[hidden] { display: none; }
  .flipped.runs .pair > div + div { position: absolute; inset: 0; opacity: var(--over); mix-blend-mode: var(--blend); }
  .flipped.runs .pair.difference { filter: brightness(3); }
  .flipped.runs .pair p { display: none; } }
</style>)";

constexpr const char* kPairControls = R"(<div class="controls">
<label>Picture <select class="which"></select></label>
<button class="flip" type="button">Flip</button>
<label>recorded <input class="over" type="range" min="0" max="100" value="50"> simulated</label>
<label><input class="differ" type="checkbox"> difference, three times as bright</label>
<label>nearer <input class="nearer" type="range" min="1" max="6" step="0.5" value="1"></label>
</div>
)";

std::string one_of(const std::string& png, const std::string& what) {
  return fmt::format("<div><img alt=\"{0}\" src=\"data:image/png;base64,{1}\"><p>{0}</p></div>", escape_html(what),
                     base64(png));
}

}  // namespace

std::string flipped_pictures(const std::vector<PicturePair>& pairs) {
  std::string markup = std::string(kPairStyle) + "<div class=\"flipped\">\n" + kPairControls +
                       "<div class=\"frame\" tabindex=\"0\" role=\"group\" aria-label=\"the two pictures\">\n";
  for (const PicturePair& pair : pairs)
    markup +=
        fmt::format("<div class=\"pair\" data-name=\"{}\">{}{}</div>\n", escape_html(pair.name),
                    one_of(pair.recorded, pair.name + ": recorded"), one_of(pair.simulated, pair.name + ": simulated"));
  return markup + "</div>\n</div>\n<script>\n" + flipped_pictures_script + "</script>\n";
}

}  // namespace selvedge::report
