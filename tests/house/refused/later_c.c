/* Must be refused: an anonymous struct is later than C99. */
struct later {
    struct {
        int a;
    };
};

struct later sample;
