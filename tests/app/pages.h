#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "integration/web/embedded.h"
#include "tests/files/temporary_folder.h"

/// Pages for browsers, as the program writes them.
namespace palpate::app {

/// False where palpate was built without NiiVue, which could not be loaded then.
inline bool writes_pages() {
  return !web::embedded(web::Embedded::kNiiVue).empty();
}

/// What a page shows, which stands in it as JSON.
inline nlohmann::json page_data(const std::filesystem::path& page) {
  const std::string text = files::read_bytes(page), before = "id=\"palpate-data\">";
  const size_t from = text.find(before) + before.size();
  return nlohmann::json::parse(text.substr(from, text.find("</script>", from) - from));
}

}  // namespace palpate::app
