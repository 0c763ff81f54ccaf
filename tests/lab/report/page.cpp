#include "tests/lab/report/page.h"

#include <array>
#include <cctype>

#include <fmt/format.h>

#include "tests/lab/report/page_style.h"

namespace palpate::report {
namespace {

/// A text as XML reads it, in an element or an attribute.
std::string xml_text(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '&') {
      result += "&amp;";
    } else if (c == '<') {
      result += "&lt;";
    } else if (c == '>') {
      result += "&gt;";
    } else if (c == '"') {
      result += "&quot;";
    } else if (static_cast<unsigned char>(c) >= 0x20U || c == '\n' || c == '\t') {
      // Other control characters are not allowed in XML.
      result += c;
    }
  }
  return result;
}

std::string paragraphs(const std::string& text, const char* of_class) {
  std::string result;
  size_t begin = 0;
  while (begin < text.size()) {
    const size_t end = std::min(text.find("\n\n", begin), text.size());
    if (end > begin)
      result += fmt::format("<p{}>{}</p>\n", of_class, xml_text(text.substr(begin, end - begin)));
    begin = end + 2;
  }
  return result;
}

std::string base64(const std::string& bytes) {
  constexpr const char* kLetters =
      "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string result;
  for (size_t n = 0; n < bytes.size(); n += 3) {
    unsigned value = 0;
    for (size_t k = 0; k < 3; ++k)
      value = value << 8U | (n + k < bytes.size() ? static_cast<unsigned char>(bytes[n + k]) : 0U);
    for (size_t k = 0; k < 4; ++k) {
      const bool padding = n + k > bytes.size();
      result += padding ? '=' : kLetters[value >> (18U - 6U * unsigned(k)) & 63U];
    }
  }
  return result;
}

std::string csv_link(const Table& table, const std::string& title) {
  if (table.rows.empty()) return "";
  return fmt::format(
      "<a class=\"csv\" download=\"{}.csv\" href=\"data:text/csv;charset=utf-8;base64,{}\">the "
      "numbers (CSV)</a>",
      file_stem(title), base64(flat_csv(table)));
}

std::string table_html(const Table& table) {
  std::string result = "<div class=\"scroll\"><table>\n<thead><tr>";
  for (size_t c = 0; c < table.columns.size(); ++c)
    result += fmt::format("<th{}>{}</th>", is_numeric(table, c) ? " class=\"n\"" : "",
                          xml_text(table.columns[c].heading));
  result += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    result += "<tr>";
    for (size_t c = 0; c < row.size(); ++c)
      result += fmt::format("<td{}>{}</td>", is_numeric(table, c) ? " class=\"n\"" : "",
                            xml_text(row[c].text));
    result += "</tr>\n";
  }
  return result + "</tbody></table></div>\n";
}

struct PartHtml {
  std::string operator()(const Figure& figure) const {
    return fmt::format(
        "<figure>\n<h3>{}</h3>\n<div "
        "class=\"scroll\">{}</div>\n<figcaption>{}{}</figcaption>\n</figure>\n",
        xml_text(figure.title), figure.svg,
        figure.caption.empty() ? "" : xml_text(figure.caption) + " ",
        csv_link(figure.data, figure.title));
  }
  std::string operator()(const TablePart& part) const {
    const Table& table = part.table;
    const std::string inner = paragraphs(table.note, " class=\"note\"") + table_html(table) +
                              "<p class=\"note\">" + csv_link(table, table.title) + "</p>\n";
    if (part.folded) {
      return fmt::format("<details><summary>{}</summary>\n{}</details>\n", xml_text(table.title),
                         inner);
    }
    return fmt::format("<h3>{}</h3>\n{}", xml_text(table.title), inner);
  }
  std::string operator()(const Note& note) const {
    return paragraphs(note.text, note.grave ? " class=\"grave\"" : "");
  }
};

std::string section_html(const Section& section) {
  std::string result = fmt::format("<section id=\"{}\">\n<h2>{}</h2>\n", xml_text(section.id),
                                   xml_text(section.title));
  if (!section.answer.empty())
    result += "<div class=\"answer\">\n" + paragraphs(section.answer, "") + "</div>\n";
  for (const Part& part : section.parts) result += std::visit(PartHtml{}, part);
  return result + "</section>\n";
}

std::string csv_field(const std::string& text) {
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string result = "\"";
  for (const char c : text) result += c == '"' ? std::string("\"\"") : std::string(1, c);
  return result + "\"";
}

}  // namespace

std::string flat_csv(const Table& table) {
  std::string result;
  for (size_t c = 0; c < table.columns.size(); ++c)
    result += (c ? "," : "") + csv_field(table.columns[c].key);
  result += "\n";
  for (const auto& row : table.rows) {
    for (size_t c = 0; c < row.size(); ++c)
      result += (c ? "," : "") +
                (row[c].number ? fmt::format("{}", *row[c].number) : csv_field(row[c].text));
    result += "\n";
  }
  return result;
}

std::string file_stem(const std::string& text) {
  std::string result;
  for (const char c : text) {
    const auto letter = static_cast<unsigned char>(c);
    if (std::isalnum(letter)) {
      result += char(std::tolower(letter));
    } else if (!result.empty() && result.back() != '-') {
      result += '-';
    }
  }
  while (!result.empty() && result.back() == '-') result.pop_back();
  return result.empty() ? "table" : result;
}

std::string html(const Page& page) {
  std::string result = fmt::format(
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n"
      "<meta charset=\"utf-8\"/>\n<meta name=\"viewport\" content=\"width=device-width, "
      "initial-scale=1\"/>\n<title>{0}</title>\n<style>{1}</style>\n</head>\n<body>\n<header>\n"
      "<h1>{0}</h1>\n",
      xml_text(page.title), kPageStyle);
  result += paragraphs(page.lead, "") + "<dl>\n";
  for (const auto& [name, value] : page.conditions)
    result += fmt::format("<div><dt>{}</dt><dd>{}</dd></div>\n", xml_text(name), xml_text(value));
  result += "</dl>\n</header>\n";
  if (page.sections.size() > 1) {
    result += "<nav>";
    for (const Section& section : page.sections)
      result +=
          fmt::format("<a href=\"#{}\">{}</a>", xml_text(section.id), xml_text(section.title));
    result += "</nav>\n";
  }
  result += "<main>\n";
  for (const Section& section : page.sections) result += section_html(section);
  return result + "</main>\n</body>\n</html>\n";
}

}  // namespace palpate::report
