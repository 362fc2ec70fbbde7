#pragma once

#include "io/scanner.hpp"

#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace hexopt::io_detail {

/// One tag of an XML text.
struct XmlTag {
    std::string_view name;
    std::vector<std::pair<std::string_view, std::string>> attributes; ///< values with entities replaced
    bool is_start = false;                                            ///< <name ...> or <name .../>
    bool is_end = false;                                              ///< </name> or <name .../>
    std::size_t begin = 0;                                            ///< position of '<'
    std::size_t end = 0;                                              ///< position after '>'

    /// The attribute's value, or nullptr.
    const std::string* find(std::string_view attribute) const;
};

/// Finds the next tag from scanner.position() on and moves behind it; comments and processing instructions
/// are skipped. False at the end of the text (scanner.ok()) and where the text is no XML (!scanner.ok()).
/// Document type declarations and CDATA are refused.
bool next_tag(Scanner& scanner, XmlTag& tag);

} // namespace hexopt::io_detail
