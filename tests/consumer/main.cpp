#include <hexopt/hexopt.hpp>

#include <iostream>

int main() {
    hexopt::Optimizer optimizer({.threads = 1});
    optimizer.cancel();
    std::cout << "hexopt " << hexopt_version_string() << '\n';
}
