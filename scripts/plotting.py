"""What the scripts that draw share: loading matplotlib without a display."""


def load_pyplot(fail):
    """matplotlib.pyplot for files only; calls fail(message) where matplotlib is missing."""
    try:
        import matplotlib
        matplotlib.use("Agg")
        import matplotlib.pyplot as plt
    except ImportError as error:
        fail(f"matplotlib cannot be loaded ({error}). Debian: apt-get install python3-matplotlib, "
             "and start this script with /usr/bin/python3 if another Python comes first.")
    return plt
