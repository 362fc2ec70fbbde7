#include <hexopt/hexopt.h>

#include <stdio.h>

int main(void) {
    hexopt_context* context = NULL;
    if (hexopt_interface_version() != HEXOPT_VERSION) return 1;
    if (hexopt_context_create(NULL, &context) != HEXOPT_OK) return 2;
    printf("hexopt %s\n", hexopt_version_string());
    hexopt_context_destroy(context);
    return 0;
}
