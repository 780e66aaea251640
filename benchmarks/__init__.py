"""What a step costs, as ratios against something measured in the same run."""
