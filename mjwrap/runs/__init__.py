"""What a run needs besides the model: excitation signals and where they go."""
