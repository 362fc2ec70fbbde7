#include "core/result.hpp"

namespace hexopt {

const char* name_of(ErrorCode code) {
    switch (code) {
    case ErrorCode::ok:
        return "ok";
    case ErrorCode::usage:
        return "usage";
    case ErrorCode::bad_input:
        return "bad_input";
    case ErrorCode::output_failed:
        return "output_failed";
    case ErrorCode::no_valid_mesh:
        return "no_valid_mesh";
    case ErrorCode::device:
        return "device";
    case ErrorCode::out_of_memory:
        return "out_of_memory";
    case ErrorCode::cancelled:
        return "cancelled";
    case ErrorCode::below_target:
        return "below_target";
    }
    return "unknown";
}

std::string Error::one_line() const {
    std::string line = stage;
    if (!where.empty()) line += (line.empty() ? "" : ": ") + where;
    const char* separator = line.empty() ? "" : ": ";
    for (const std::string& reason : reasons) {
        line += separator + reason;
        separator = "; ";
    }
    for (char& c : line)
        if (c == '\n' || c == '\r') c = ' ';
    return line;
}

} // namespace hexopt
